"""Joint readings: sampled positions, with measured or differenced velocities."""

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.law_signals import ReadingSignals
from geoimp_drake.parts.part import Memory, Now, Output
from geoimp_drake.parts.signals import check_signal
from geoimp_drake.typing import Array
from geoimp_drake.validation import finite_vector

__all__ = ["Readings"]

_ALL = slice(None)


class Readings:
    """The part of `JointReadings`; arguments and errors are the same."""

    def __init__(
        self,
        num_positions: int,
        period: float = 1e-3,
        velocity: str = "measured",
        turns: Array | None = None,
    ):
        if not (np.isfinite(period) and period > 0):
            raise ConfigurationError(f"The sampling period is {period:g} s; it must be positive.")
        if velocity not in ("measured", "differenced"):
            raise ConfigurationError(
                f"Unknown velocity source '{velocity}'; valid ones: measured, differenced."
            )
        n = 2 * num_positions
        self.period = period
        given = np.zeros(num_positions) if turns is None else turns
        turning = finite_vector(given, "turns", num_positions)
        self._sampling = velocity == "differenced", turning
        self.inputs = {"state": n}
        # The count of readings is 0 for none, 1 for the first and 2 for more.
        self.memory = Memory(reading=np.zeros(n), count=0.0)
        self.samplings = ((period, self.sample),)
        self.outputs = (Output("estimated_state", n, self._write, ("memory", "state")),)

    def new_workspace(
        self, state: Array | None = None, memory: Array | None = None
    ) -> ReadingSignals:
        """Returns where a reading is taken: in the arrays of input and memory, if they persist."""
        return ReadingSignals(len(self._sampling[1]), *self._sampling, state, memory)

    def start(self, memory: Array, now: Now, port: str = "state") -> None:
        """Takes the first reading, with the measured velocity; `port` is the input's name.

        Raises:
            SignalError: the reading is NaN or infinite.
        """
        state = now[port]
        check_signal(state, now.port(port))
        memory[self.memory.reading] = state
        memory[self.memory.count] = 1.0

    def sample(self, memory: Array, now: Now) -> None:
        """Takes another reading."""
        self.take(memory, _ALL, now, "state", now.workspace)

    def take(
        self, memory: Array, place: slice, now: Now, port: str, signals: ReadingSignals
    ) -> None:
        """Takes another reading.

        Args:
            memory: updated.
            place: of this part's memory in it.
            now: the inputs.
            port: the name of the input.
            signals: of `new_workspace`.

        Raises:
            SignalError: the reading is NaN or infinite.
        """
        state, elapsed = now[port], now.elapsed
        if not signals.take(state, memory, place, self.period if elapsed is None else elapsed):
            check_signal(state, now.port(port))

    def held(self, memory: Array, now: Now, port: str = "state") -> Array:
        """Returns a memory with a reading: before the first one, that of the port passes through.

        Args:
            memory: of this part, which may be written.
            now: the inputs.
            port: the name of the input.
        """
        if not memory[self.memory.count]:
            memory[self.memory.reading] = now[port]
        return memory

    def _write(self, now: Now, reading: Array) -> None:
        reading[:] = self.held(now.memory, now)[self.memory.reading]
