"""A part called by hand, tick by tick, in place of a simulator: its state is one array."""

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from geoimp_drake.compilation.compiled import bound
from geoimp_drake.errors import SignalError
from geoimp_drake.laws.explicit_euler import explicit_euler, steps_of
from geoimp_drake.parts.part import (
    Begins,
    Checks,
    Finds,
    Flows,
    Memory,
    Part,
    Samples,
    Settles,
    Starts,
    Stays,
    Works,
)
from geoimp_drake.typing import Array
from geoimp_drake.validation import unknown_name

__all__ = ["PartLoop"]

# The longest gap that the loop catches up on, in periods.
_MOST_STEPS = 1000


class PartLoop:
    """Runs a part as a simulator with steps of explicit Euler runs its system.

    In a tick the part samples the new readings. Its continuous state is integrated over the time
    since the previous tick, with these readings and the old targets. Its outputs follow from all of
    them. A simulator does the same: a discrete plant is read as it will be at the end of a step.
    After lost ticks it integrates in steps of at most the shortest period of the part's samples.

    Args:
        part: a whole controller; its inputs are vectors.
        name: of the loop, in messages.

    Attributes:
        state: all that the part remembers, in one array that may be copied and written. It holds
            the memory, the continuous state, the inputs of the last tick, and the time [s].
    """

    def __init__(self, part: Part, name: str):
        self._part: Any = part
        flow = part.state if isinstance(part, Flows) else Memory()
        self._inputs = Memory(**{name: np.zeros(size) for name, size in part.inputs.items()})
        places = Memory(memory=part.memory, flow=flow, inputs=self._inputs, time=0.0)
        self._start, self._time = places.start, places.time
        self.state = places.start.copy()
        self._memory, self._flow = self.state[places.memory], self.state[places.flow]
        inputs = self.state[places.inputs]
        self._values = {name: inputs[getattr(self._inputs, name)] for name in part.inputs}
        self._rate = np.zeros(len(flow))
        self._now = _Tick(part, name, self._values, self._memory, self._flow, self._rate)
        self._integrate = bound(explicit_euler, self._flow, self._rate)
        self._is_flowing, self._begins = isinstance(part, Flows), isinstance(part, Begins)
        samplings = part.samplings if isinstance(part, Samples) else []
        self._takes = [take for _, take in samplings]
        self._longest = min((period for period, _ in samplings), default=np.inf)

    def reset(self, inputs: Mapping[str, Array], time: float = 0.0) -> None:
        """Starts the part on its inputs, as a simulator's initialization does.

        Args:
            inputs: by name; those that are not given count as not connected.
            time: [s].

        Raises:
            SignalError: an input is of another size. Errors of the part pass, too.
            ConfigurationError: there is no such input.
        """
        part, now = self._part, self._now
        self.state[:] = self._start
        self.state[self._time] = now.time = time
        now.given = set(inputs)
        self._take_in(inputs)
        now.moved()
        if isinstance(part, Starts):
            part.start(self._memory, now)
        if isinstance(part, Settles):
            now.moved()
            part.settle(self._memory, now)
        now.moved()
        if isinstance(part, Checks):
            part.check_start(now)
        self._begin()

    def step(
        self, readings: Mapping[str, Array], targets: Mapping[str, Array], elapsed: float
    ) -> None:
        """Advances by one tick.

        Args:
            readings: inputs that have been measured, by name; others keep what `input` holds.
            targets: inputs that are functions of time, at the end of the tick; until then they keep
                their values.
            elapsed: time since the last tick [s].

        Raises:
            SignalError: no time has passed or too much, or an input is of another size. Errors of
                the part pass, too.
            ConfigurationError: there is no such input.
        """
        if not 0.0 < elapsed < np.inf:
            raise SignalError(
                f"{self._now.system}: the time since the last tick is {elapsed} s; it must be "
                f"positive."
            )
        now = self._now
        now.elapsed = elapsed = float(elapsed)
        self.state[self._time] = now.time = self.state.item(self._time) + elapsed
        self._take_in(readings)
        now.moved()
        if elapsed <= self._longest and now.ticks(targets, elapsed):
            return
        for take in self._takes:
            take(self._memory, now)
        if self._is_flowing:
            self._flow_on(elapsed)
        self._take_in(targets)
        now.moved()
        self._begin()

    def feed(self, inputs: Mapping[str, Array]) -> None:
        """Gives inputs that follow from outputs of this very tick.

        Args:
            inputs: by name.

        Raises:
            SignalError: an input is of another size.
            ConfigurationError: there is no such input.
        """
        self._now.time = self.state.item(self._time)
        self._take_in(inputs)
        self._now.moved()

    def input(self, name: str) -> Array:
        """Returns an input's place in the state, for readings that are written there before a step.

        Raises:
            ConfigurationError: there is no such input.
        """
        value = self._values.get(name)
        if value is None:
            raise unknown_name(name, f"input of {self._now.system}", self._values)
        return value

    def output(self, name: str) -> Array:
        """Returns an output of the last tick, in an array that the next tick overwrites.

        Raises:
            ConfigurationError: there is no such output.
        """
        return self._now.output(name)

    def _flow_on(self, elapsed: float) -> None:
        """Integrates the state over the time since the last tick."""
        steps = 1 if elapsed <= self._longest else steps_of(elapsed, self._longest)
        if steps > _MOST_STEPS:
            raise SignalError(
                f"{self._now.system}: the time since the last tick is {elapsed:g} s; after more "
                f"than {_MOST_STEPS * self._longest:g} s, reset."
            )
        for _ in range(steps):
            self._now.moved()
            self._part.rate(self._now, self._rate)
            self._integrate(elapsed / steps)

    def _begin(self) -> None:
        if self._begins:
            self._part.begin(self._memory, self._flow, self._now)

    def _take_in(self, inputs: Mapping[str, Array]) -> None:
        for name, value in inputs.items():
            held = self.input(name)
            if len(value) != len(held):
                raise SignalError(
                    f"Port '{self._now.port(name)}' got {len(value)} numbers; it takes {len(held)}."
                )
            held[:] = value


class _Tick(dict[str, Array]):
    """A `Now` of arrays; its items are the inputs."""

    def __init__(
        self,
        part: Any,
        name: str,
        values: dict[str, Array],
        memory: Array,
        state: Array,
        rate: Array,
    ):
        super().__init__(values)
        self.system, self.memory, self.state = name, memory, state
        self.time = 0.0
        self.elapsed: float | None = None
        self._part = part
        self.given: set[str] = set()
        self.workspace = part.new_workspace() if isinstance(part, Works) else None
        self._found = part.new_found() if isinstance(part, Finds) else None
        self._tick: Any = None
        if isinstance(part, Stays):
            self.workspace, self._found, self._tick = part.stay(memory, values, state, rate)
        self._is_found = False
        self._writes = {output.name: output.write for output in part.outputs}
        self._outputs = {output.name: np.zeros(output.size) for output in part.outputs}
        self._written: set[str] = set()

    def moved(self) -> None:
        """Forgets what followed from inputs, memory and time."""
        self._is_found = False
        self._written.clear()

    def ticks(self, targets: Mapping[str, Array], elapsed: float) -> bool:
        """Does a tick in one call, if the part can; returns whether it has been done."""
        self._is_found = self._tick is not None and self._tick(self, targets, elapsed)
        return self._is_found

    @property
    def found(self) -> Any:
        if not self._is_found:
            self._part.find(self, self._found)
            self._is_found = True
        return self._found

    def has(self, name: str) -> bool:
        return name in self.given

    def has_any(self, names: Collection[str]) -> bool:
        return not self.given.isdisjoint(names)

    def port(self, name: str) -> str:
        return f"{self.system}:{name}"

    def output(self, name: str) -> Array:
        value = self._outputs.get(name)
        if value is None:
            raise unknown_name(name, f"output of {self.system}", self._outputs)
        if name not in self._written:
            self._writes[name](self, value)
            self._written.add(name)
        return value
