"""What the systems of a part share for every scalar type: ports, state, cache and events."""

from collections.abc import Callable, Collection, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import (
    BasicVector,
    CacheEntry,
    Context,
    DependencyTicket,
    DiscreteStateIndex,
    InputPort,
    LeafSystem,
    OutputPort,
    ValueProducer,
)

from geoimp_drake.errors import ConversionError
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE
from geoimp_drake.parts.part import (
    Begins,
    Checks,
    Finds,
    Flows,
    Output,
    Part,
    Samples,
    Settles,
    Works,
)
from geoimp_drake.parts.signals import AT_REST
from geoimp_drake.typing import Array

__all__ = ["PartShell", "PartView", "seconds"]


class PartShell(LeafSystem if TYPE_CHECKING else object):  # type: ignore[misc]
    """Declares a part's ports, state, cache and events in a LeafSystem of any scalar type.

    A system that derives from it has the events `_start`, `_settle`, `_sample` and `_begin`. Its
    `_calc_by` calculates an output port from what a part writes.
    """

    # For the system's scalar type: its vector, and what makes a workspace of floats one of that
    # type.
    _vector: Any = BasicVector
    _own: Callable[[Any], Any] = staticmethod(lambda made: made)

    def _declare(self, part: Part) -> None:
        self._part: Any = part
        self._inputs = {name: self._declare_input(name, kind) for name, kind in part.inputs.items()}
        self._values = {name: port.Eval for name, port in self._inputs.items()}
        self._has = {name: port.HasValue for name, port in self._inputs.items()}
        self._memory = -1
        if part.memory:
            self._memory = int(self.DeclareDiscreteState(self._vector(part.memory.start)))
        self._flows = isinstance(part, Flows)
        if isinstance(part, Flows):
            self.DeclareContinuousState(self._vector(part.state.start))
        if isinstance(part, Works):
            self._workspace = self._declare_cache("workspace", part.new_workspace)
        if isinstance(part, Finds):
            tickets = self._tickets(part.found_of)
            self._found = self._declare_cache("found", part.new_found, self._find, tickets)
        self._outputs = {output.name: self._declare_output(output) for output in part.outputs}
        self._declare_events()

    @property
    def part(self) -> Any:
        """The part."""
        return self._part

    def _declare_input(self, name: str, kind: Any) -> InputPort:
        if isinstance(kind, int):
            return self.DeclareVectorInputPort(name, self._vector(_model(kind)))
        return self.DeclareAbstractInputPort(name, AbstractValue.Make(kind))

    def _declare_cache(
        self,
        name: str,
        allocate: Callable[[], Any],
        calc: Callable[[Context, AbstractValue], None] = lambda context, value: None,
        tickets: set[DependencyTicket] | None = None,
    ) -> CacheEntry:
        producer = ValueProducer(lambda: AbstractValue.Make(self._own(allocate())), calc)
        return self.DeclareCacheEntry(name, producer, tickets or {self.nothing_ticket()})

    def _declare_output(self, output: Output) -> OutputPort:
        model = self._vector(_model(output.size))
        calc, tickets = self._calc_by(output.write), self._tickets(output.of)
        return self.DeclareVectorOutputPort(output.name, model, calc, tickets)

    def _tickets(self, names: Sequence[str]) -> set[DependencyTicket]:
        tickets = {self._ticket(name) for name in names if name != "memory" or self._part.memory}
        return tickets or {self.nothing_ticket()}

    def _ticket(self, name: str) -> DependencyTicket:
        if name in self._inputs:
            return self.input_port_ticket(self._inputs[name].get_index())
        return {
            "memory": lambda: self.discrete_state_ticket(DiscreteStateIndex(self._memory)),
            "state": self.xc_ticket,
            "time": self.time_ticket,
            "found": lambda: self._found.ticket(),
        }[name]()

    def _declare_events(self) -> None:
        part = self._part
        if part.memory or isinstance(part, Flows):
            self.DeclareInitializationUnrestrictedUpdateEvent(self._start)
        if isinstance(part, Settles):
            self.DeclareInitializationDiscreteUpdateEvent(self._settle)
        if isinstance(part, Checks):
            self.DeclareInitializationPublishEvent(self._check)
        if isinstance(part, Samples):
            for period in dict(part.samplings):
                takes = [take for its, take in part.samplings if its == period]
                # The offset is zero, so that its instants are those of the plant's steps to the
                # last bit.
                sample = partial(self._sample, takes)
                self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, sample)
        if isinstance(part, Begins):
            # Unrestricted updates come first, like the step of a plant with sampled output ports:
            # what that step has evaluated is not evaluated again.
            self.DeclarePerStepUnrestrictedUpdateEvent(self._begin)

    def _check(self, context: Context) -> None:
        self._part.check_start(PartView(self, context))

    def _find(self, context: Context, value: AbstractValue) -> None:
        self._part.find(PartView(self, context), value.get_mutable_value())


def _model(size: int) -> Any:
    """Returns a model value for a vector, or its size; a frame motion rests at W's origin."""
    return AT_REST if size == FRAME_MOTION_SIZE else size


def seconds(time: Any) -> float:
    """Returns an `AutoDiffXd` time as a number; raises ConversionError if it has derivatives."""
    if np.any(time.derivatives()):
        raise ConversionError(
            "A derivative by time was asked for, and blocks take time as a plain number"
        )
    return float(time.value())


class PartView:
    """A `Now`: a part's system in a context."""

    __slots__ = ("_context", "_system", "_values")

    elapsed = None

    def __init__(self, system: Any, context: Context):
        self._system, self._context, self._values = system, context, system._values

    @property
    def time(self) -> float:
        """Time [s]."""
        time = self._context.get_time()
        return time if isinstance(time, float) else seconds(time)

    @property
    def system(self) -> str:
        """The system's name."""
        return str(self._system.get_name())

    @property
    def memory(self) -> Array:
        """A copy of the memory."""
        # A copy: a law is compiled once more for an array that cannot be written to.
        memory: Array = self._context.get_discrete_state(self._system._memory).CopyToVector()
        return memory

    @property
    def state(self) -> Array:
        """A copy of the continuous state."""
        state: Array = self._context.get_continuous_state_vector().CopyToVector()
        return state

    @property
    def found(self) -> Any:
        """The values that the part has found."""
        return self._system._found.Eval(self._context)

    @property
    def workspace(self) -> Any:
        """Its workspace."""
        return self._system._workspace.Eval(self._context)

    def __getitem__(self, name: str) -> Any:
        return self._values[name](self._context)

    def has(self, name: str) -> bool:
        """See `Now`, also for the others."""
        has = self._system._has.get(name)
        return has is not None and bool(has(self._context))

    def has_any(self, names: Collection[str]) -> bool:
        """Whether one is connected."""
        ports, context = self._system._has, self._context
        return any(name in ports and ports[name](context) for name in names)

    def port(self, name: str) -> str:
        """The name for errors."""
        return f"{self.system}:{name}"

    def output(self, name: str) -> Array:
        """The value of an output."""
        value: Array = self._system._outputs[name].Eval(self._context)
        return value
