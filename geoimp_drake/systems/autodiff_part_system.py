"""A part as a LeafSystem for `AutoDiffXd`: the same laws, as they are written."""

from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd
from pydrake.systems.framework import BasicVector_, LeafSystem_

from geoimp_drake.parts.part import NOTHING, Flows, Now, Part, Starts
from geoimp_drake.systems.part_shell import PartShell, PartView
from geoimp_drake.typing import Array

__all__ = ["AutoDiffPartSystem", "FlowingAutoDiffPartSystem", "autodiff_system_of"]


class AutoDiffPartSystem(PartShell, LeafSystem_[AutoDiffXd]):
    """A `PartSystem` for `AutoDiffXd`; values are copied, since Drake lends none of that type.

    Args:
        part: see `geoimp_drake.parts.part`; it takes no samples.
    """

    _vector = BasicVector_[AutoDiffXd]
    _own = staticmethod(lambda made: made.autodiff() if hasattr(made, "autodiff") else made)

    def __init__(self, part: Part):
        LeafSystem_[AutoDiffXd].__init__(self)
        self._declare(part)

    def _calc_by(self, write: Callable[[Now, Array], None]) -> Callable[[Any, Any], None]:
        def calc(context: Any, value: Any) -> None:
            array = _zeros(value.size())
            write(PartView(self, context), array)
            value.SetFromVector(array)

        return calc

    def _start(self, context: Any, state: Any) -> None:
        memory = self._part.memory.start.astype(object)
        if isinstance(self._part, Starts):
            self._part.start(memory, PartView(self, context))
        self._write(state, memory, self._part.state.start if self._flows else NOTHING)

    def _settle(self, context: Any, state: Any) -> None:
        memory = state.get_vector(self._memory).CopyToVector()
        self._part.settle(memory, PartView(self, context))
        state.set_value(self._memory, memory)

    def _begin(self, context: Any, state: Any) -> None:
        view = PartView(self, context)
        memory = view.memory if self._memory >= 0 else NOTHING
        flow = view.state if self._flows else NOTHING
        self._part.begin(memory, flow, view)
        self._write(state, memory, flow)

    def _write(self, state: Any, memory: Array, flow: Array) -> None:
        if self._memory >= 0:
            state.get_mutable_discrete_state(self._memory).SetFromVector(memory)
        if self._flows:
            state.get_mutable_continuous_state().SetFromVector(flow)


class FlowingAutoDiffPartSystem(AutoDiffPartSystem):
    """The same for a part with continuous state."""

    def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
        """Has the part write the derivative of its state."""
        rate = _zeros(len(self._part.state))
        self._part.rate(PartView(self, context), rate)
        derivatives.SetFromVector(rate)


def autodiff_system_of(part: Part) -> AutoDiffPartSystem:
    """Returns a part as a LeafSystem for `AutoDiffXd`."""
    return (FlowingAutoDiffPartSystem if isinstance(part, Flows) else AutoDiffPartSystem)(part)


def _zeros(size: int) -> Array:
    return np.full(size, AutoDiffXd(0.0))
