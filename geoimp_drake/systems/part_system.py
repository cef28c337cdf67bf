"""A Drake LeafSystem of any part of a controller."""

from collections.abc import Callable
from typing import Any, Self

import numpy as np
from pydrake.autodiffutils import AutoDiffXd
from pydrake.systems.framework import (
    BasicVector,
    Context,
    ContinuousState,
    DependencyTicket,
    DiscreteStateIndex,
    DiscreteValues,
    LeafSystem,
    State,
    SystemScalarConverter,
)

from geoimp_drake.errors import ConversionError
from geoimp_drake.parts.part import NOTHING, Flows, Now, Part, Samples, Starts
from geoimp_drake.systems.part_shell import PartShell, PartView
from geoimp_drake.typing import Array

__all__ = ["IS_PYBIND11", "Block", "FlowingPartSystem", "PartSystem", "system_of"]

# Whether pybind11 binds Drake to Python; later Drakes use nanobind.
IS_PYBIND11 = type(LeafSystem).__name__ == "pybind11_type"


def _convert(block: Any) -> Any:
    """Returns a block for `AutoDiffXd`; raises ConversionError if it has no such form."""
    if not hasattr(block, "to_autodiff"):
        raise ConversionError(f"'{block.get_name()}', a {type(block).__name__}, is float only")
    form = block.to_autodiff()
    form.set_name(block.get_name())
    return form


_CONVERTER = SystemScalarConverter()
_CONVERTER._AddConstructor[AutoDiffXd, float](_convert)


class Block(LeafSystem):
    """A LeafSystem in Python that costs a simulation less time; it has no witness functions.

    A block is converted to `AutoDiffXd` by its method `to_autodiff`, if it has one.

    After every step of a discrete plant Drake asks each system again for its witness functions. For
    a system in Python, Drake searches for a method `DoGetWitnessFunctions`; the search fails each
    time and costs as much as a small law. With pybind11 the method is found here. As a function of
    C++ it counts as not overridden, and pybind11 remembers that. Later Drakes use nanobind, which
    would call whatever it finds; there nothing is done.
    """

    if IS_PYBIND11:
        DoGetWitnessFunctions = LeafSystem.GetWitnessFunctions

    def __init__(self) -> None:
        LeafSystem.__init__(self, _CONVERTER)

    def declare_state(self, model: Array | BasicVector | int) -> int:
        """Declares a group of discrete state; returns its index.

        The index is a plain integer: a `DiscreteStateIndex` would be converted, by a call, at every
        use.

        Args:
            model: initial values, or how many zeros.
        """
        return int(self.DeclareDiscreteState(model))

    def ticket_of_state(self, index: int) -> DependencyTicket:
        """Returns the dependency ticket of a group of discrete state.

        Args:
            index: the group's index.
        """
        return self.discrete_state_ticket(DiscreteStateIndex(index))


class PartSystem(PartShell, Block):
    """A part as a LeafSystem: ports by name, memory as discrete state, state as continuous state.

    Initialization resets memory and state to their initial values, and starts the part. The ports
    and the errors are those of the part.

    Args:
        part: see `geoimp_drake.parts.part`.
    """

    def __init__(self, part: Part):
        Block.__init__(self)
        self._declare(part)

    @classmethod
    def of(cls, part: Part) -> Self:
        """Returns a system of this class for an existing part."""
        system = cls.__new__(cls)
        PartSystem.__init__(system, part)
        return system

    def to_autodiff(self) -> Any:
        """Returns the same part for `AutoDiffXd`.

        Raises:
            ConversionError: it samples, or says why it is `float_only`.
        """
        from geoimp_drake.systems.autodiff_part_system import autodiff_system_of

        reason = getattr(self._part, "float_only", "")
        if isinstance(self._part, Samples):
            periods = " and ".join(f"{period:g} s" for period, _ in self._part.samplings)
            reason = f"takes samples every {periods}"
        if reason:
            raise ConversionError(f"'{self.get_name()}' {reason}")
        return autodiff_system_of(self._part)

    def _calc_by(
        self, write: Callable[[Now, Array], None]
    ) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, value: BasicVector) -> None:
            write(PartView(self, context), value.get_mutable_value())

        return calc

    def _start(self, context: Context, state: State) -> None:
        memory = NOTHING
        if self._part.memory:
            memory = state.get_mutable_discrete_state(self._memory).get_mutable_value()
            memory[:] = self._part.memory.start
        if isinstance(self._part, Flows):
            state.get_mutable_continuous_state().SetFromVector(self._part.state.start)
        if isinstance(self._part, Starts):
            self._part.start(memory, PartView(self, context))

    def _settle(self, context: Context, state: DiscreteValues) -> None:
        self._part.settle(state.get_mutable_value(self._memory), PartView(self, context))

    def _sample(
        self, takes: list[Callable[[Array, Now], None]], context: Context, state: DiscreteValues
    ) -> None:
        # Drake hands over a copy of the context's state.
        memory, now = state.get_mutable_value(self._memory), PartView(self, context)
        for take in takes:
            take(memory, now)

    def _begin(self, context: Context, state: State) -> None:
        memory, flow = NOTHING, NOTHING
        if self._memory >= 0:
            memory = state.get_mutable_discrete_state(self._memory).get_mutable_value()
        if self._flows:
            flow = context.get_continuous_state_vector().CopyToVector()
        self._part.begin(memory, flow, PartView(self, context))
        if self._flows:
            state.get_mutable_continuous_state().SetFromVector(flow)


class FlowingPartSystem(PartSystem):
    """The same for a part with continuous state; Drake asks only such a system for derivatives."""

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        """Has the part write the derivative of its state."""
        # The cache is of no use here: as a rule its values are from before the last sample. The
        # state is about to change, so nobody else could use values that were put there now.
        rate = np.empty(len(self._part.state))
        self._part.rate(PartView(self, context), rate)
        derivatives.SetFromVector(rate)


def system_of(part: Part) -> PartSystem:
    """Returns a part as a LeafSystem."""
    return (FlowingPartSystem if isinstance(part, Flows) else PartSystem)(part)
