"""Factors of an impedance's stiffness as a part of the system that has the impedance."""

from collections.abc import Callable

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, InputPort

from geoimp_drake.systems.block import Block
from geoimp_drake.systems.declaring import declare_cache, tickets_of
from geoimp_drake.typing import Array

__all__ = ["StiffnessScale"]


class StiffnessScale:
    """Declares a system's port `stiffness_scale` and finds its gains.

    Args:
        system: whose part it is.
        gains: returns the gains for the system's name and factors of K_p and K_o (2,), or None for
            one each.

    Attributes:
        port: where the factors come in; it needs not be connected.
    """

    def __init__(self, system: Block, gains: Callable[[str, Array | None], tuple[Array, ...]]):
        self.port: InputPort = system.DeclareVectorInputPort("stiffness_scale", 2)
        self._system, self._gains = system, gains
        self._constant = gains("", None)
        # They change when the scale does, not with every step.
        self._scaled = declare_cache(system, "gains", self._calc, tickets_of(system, self.port))

    def gains(self, context: Context) -> tuple[Array, ...]:
        """Returns the gains; without a scale they need not be looked up in the cache."""
        if not self.port.HasValue(context):
            return self._constant
        gains: tuple[Array, ...] = self._scaled.Eval(context)
        return gains

    def factors(self, context: Context) -> Array | None:
        """Returns the factors (2,), or None for one each."""
        return self.port.Eval(context) if self.port.HasValue(context) else None

    def _calc(self, context: Context, value: AbstractValue) -> None:
        value.set_value(self._gains(self._system.get_name(), self.port.Eval(context)))
