"""A Drake LeafSystem of any part of a controller."""

from collections.abc import Callable, Collection, Sequence
from functools import partial
from typing import Any, Self

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import (
    BasicVector,
    CacheEntry,
    Context,
    ContinuousState,
    DependencyTicket,
    DiscreteStateIndex,
    DiscreteValues,
    InputPort,
    LeafSystem,
    OutputPort,
    State,
    ValueProducer,
)

from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE
from geoimp_drake.parts.part import (
    NOTHING,
    Begins,
    Checks,
    Finds,
    Flows,
    Now,
    Output,
    Part,
    Samples,
    Settles,
    Starts,
    Works,
)
from geoimp_drake.systems.frame_motion import frame_motion_vector
from geoimp_drake.typing import Array

__all__ = ["IS_PYBIND11", "Block", "FlowingPartSystem", "PartSystem", "system_of"]

# What binds Drake to Python.
IS_PYBIND11 = type(LeafSystem).__name__ == "pybind11_type"


class Block(LeafSystem):
    """A LeafSystem written in Python that costs a simulation less; it has no witness functions.

    After every step of a discrete plant Drake asks each system again for its witness functions. For
    a system in Python that is a search for a method `DoGetWitnessFunctions`, which fails each
    time and costs as much as a small law. With pybind11 the method is found here: as a function of
    C++ it counts as not overridden, and pybind11 remembers that. nanobind, which later Drakes use,
    would call whatever it finds; there nothing is done.
    """

    if IS_PYBIND11:
        DoGetWitnessFunctions = LeafSystem.GetWitnessFunctions

    def declare_state(self, model: Array | BasicVector | int) -> int:
        """Declares a group of discrete state; returns its index.

        The index is a plain integer: one of `DiscreteStateIndex` would be converted, by a call, at
        every use.

        Args:
            model: initial values, or how many zeros.
        """
        return int(self.DeclareDiscreteState(model))

    def ticket_of_state(self, index: int) -> DependencyTicket:
        """Returns the dependency ticket of a group of discrete state.

        Args:
            index: of the group.
        """
        return self.discrete_state_ticket(DiscreteStateIndex(index))


class PartSystem(Block):
    """A part as a LeafSystem: ports by name, memory as discrete state, state as continuous state.

    Initialization resets memory and state to their initial values, and starts the part. The ports
    and the errors are those of the part.

    Args:
        part: see `geoimp_drake.parts.part`.
    """

    def __init__(self, part: Part):
        super().__init__()
        self._part: Any = part
        self._inputs = {name: self._declare_input(name, kind) for name, kind in part.inputs.items()}
        self._values = {name: port.Eval for name, port in self._inputs.items()}
        self._has = {name: port.HasValue for name, port in self._inputs.items()}
        self._memory = self.declare_state(part.memory.start) if part.memory else -1
        self._flows = isinstance(part, Flows)
        if isinstance(part, Flows):
            self.DeclareContinuousState(BasicVector(part.state.start))
        if isinstance(part, Works):
            self._workspace = self._declare_cache("workspace", part.new_workspace)
        if isinstance(part, Finds):
            tickets = self._tickets(part.found_of)
            self._found = self._declare_cache("found", part.new_found, self._find, tickets)
        self._outputs = {output.name: self._declare_output(output) for output in part.outputs}
        self._declare_events()

    @classmethod
    def of(cls, part: Part) -> Self:
        """Returns a system of this class for an existing part."""
        system = cls.__new__(cls)
        PartSystem.__init__(system, part)
        return system

    @property
    def part(self) -> Any:
        """The part."""
        return self._part

    def _declare_input(self, name: str, kind: Any) -> InputPort:
        if kind == FRAME_MOTION_SIZE:
            return self.DeclareVectorInputPort(name, frame_motion_vector())
        if isinstance(kind, int):
            return self.DeclareVectorInputPort(name, kind)
        return self.DeclareAbstractInputPort(name, AbstractValue.Make(kind))

    def _declare_cache(
        self,
        name: str,
        allocate: Callable[[], Any],
        calc: Callable[[Context, AbstractValue], None] = lambda context, value: None,
        tickets: set[DependencyTicket] | None = None,
    ) -> CacheEntry:
        producer = ValueProducer(lambda: AbstractValue.Make(allocate()), calc)
        return self.DeclareCacheEntry(name, producer, tickets or {self.nothing_ticket()})

    def _declare_output(self, output: Output) -> OutputPort:
        is_motion = output.size == FRAME_MOTION_SIZE
        model = frame_motion_vector() if is_motion else BasicVector(output.size)

        write = output.write

        def calc(context: Context, value: BasicVector) -> None:
            write(_At(self, context), value.get_mutable_value())

        return self.DeclareVectorOutputPort(output.name, model, calc, self._tickets(output.of))

    def _tickets(self, names: Sequence[str]) -> set[DependencyTicket]:
        tickets = {self._ticket(name) for name in names if name != "memory" or self._part.memory}
        return tickets or {self.nothing_ticket()}

    def _ticket(self, name: str) -> DependencyTicket:
        if name in self._inputs:
            return self.input_port_ticket(self._inputs[name].get_index())
        return {
            "memory": lambda: self.ticket_of_state(self._memory),
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
                # Without offset, so that its instants are those of the plant's steps to the last
                # bit.
                sample = partial(self._sample, takes)
                self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, sample)
        if isinstance(part, Begins):
            # Unrestricted updates come first, as a plant's step with sampled output ports does:
            # what that step has evaluated is not evaluated again.
            self.DeclarePerStepUnrestrictedUpdateEvent(self._begin)

    def _start(self, context: Context, state: State) -> None:
        memory = NOTHING
        if self._part.memory:
            memory = state.get_mutable_discrete_state(self._memory).get_mutable_value()
            memory[:] = self._part.memory.start
        if isinstance(self._part, Flows):
            state.get_mutable_continuous_state().SetFromVector(self._part.state.start)
        if isinstance(self._part, Starts):
            self._part.start(memory, _At(self, context))

    def _check(self, context: Context) -> None:
        self._part.check_start(_At(self, context))

    def _find(self, context: Context, value: AbstractValue) -> None:
        self._part.find(_At(self, context), value.get_mutable_value())

    def _settle(self, context: Context, state: DiscreteValues) -> None:
        self._part.settle(state.get_mutable_value(self._memory), _At(self, context))

    def _sample(
        self, takes: list[Callable[[Array, Now], None]], context: Context, state: DiscreteValues
    ) -> None:
        # Drake hands over a copy of the context's state.
        memory, now = state.get_mutable_value(self._memory), _At(self, context)
        for take in takes:
            take(memory, now)

    def _begin(self, context: Context, state: State) -> None:
        memory, flow = NOTHING, NOTHING
        if self._memory >= 0:
            memory = state.get_mutable_discrete_state(self._memory).get_mutable_value()
        if self._flows:
            flow = context.get_continuous_state_vector().CopyToVector()
        self._part.begin(memory, flow, _At(self, context))
        if self._flows:
            state.get_mutable_continuous_state().SetFromVector(flow)


class FlowingPartSystem(PartSystem):
    """The same for a part with continuous state; Drake asks only such a system for derivatives."""

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        """Has the part write the derivative of its state."""
        # Not by what is in the cache: as a rule it is from before the last sample, and the state is
        # about to change, so nobody else could use what would be there then.
        rate = np.empty(len(self._part.state))
        self._part.rate(_At(self, context), rate)
        derivatives.SetFromVector(rate)


def system_of(part: Part) -> PartSystem:
    """Returns a part as a LeafSystem."""
    return (FlowingPartSystem if isinstance(part, Flows) else PartSystem)(part)


class _At:
    """A `Now`: a part's system in a context."""

    __slots__ = ("_context", "_system", "_values")

    elapsed = None

    def __init__(self, system: PartSystem, context: Context):
        self._system, self._context, self._values = system, context, system._values

    @property
    def time(self) -> float:
        return float(self._context.get_time())

    @property
    def system(self) -> str:
        return str(self._system.get_name())

    @property
    def memory(self) -> Array:
        # A copy: a law is compiled once more for an array that cannot be written to.
        memory: Array = self._context.get_discrete_state(self._system._memory).CopyToVector()
        return memory

    @property
    def state(self) -> Array:
        state: Array = self._context.get_continuous_state_vector().CopyToVector()
        return state

    @property
    def found(self) -> Any:
        return self._system._found.Eval(self._context)

    @property
    def workspace(self) -> Any:
        return self._system._workspace.Eval(self._context)

    def __getitem__(self, name: str) -> Any:
        return self._values[name](self._context)

    def has(self, name: str) -> bool:
        has = self._system._has.get(name)
        return has is not None and bool(has(self._context))

    def has_any(self, names: Collection[str]) -> bool:
        ports, context = self._system._has, self._context
        return any(name in ports and ports[name](context) for name in names)

    def port(self, name: str) -> str:
        return f"{self.system}:{name}"

    def output(self, name: str) -> Array:
        value: Array = self._system._outputs[name].Eval(self._context)
        return value
