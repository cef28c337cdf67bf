"""What a supervised controller is given in the place of a reading or a wrench that is none."""

from typing import Protocol

import numpy as np

from geoimp_drake.laws.frame_motion import VELOCITY, is_finite
from geoimp_drake.parts.part import Memory, Now
from geoimp_drake.typing import Array

__all__ = ["SignalGuard"]


class _Limits(Protocol):
    force: float  # largest at E [N]
    moment: float  # largest at E [Nm]
    stuck: float  # way of D in which a signal must change [m, rad]


class SignalGuard:
    """Judges reading and wrench of a tick; in the place of what is none it gives the last one.

    A signal is none if it is not finite, or if it has repeated itself to the bit while D moved by
    `stuck`. A wrench of exactly zero may stay: that of a hand which nothing touches. A wrench
    beyond its limit is given with the limit as its length. It is a piece of the supervisor's part.

    Args:
        n: number of joints.
        limits: largest force and moment, and the way of D in which a signal must change.
        period: of a tick [s].
    """

    def __init__(self, n: int, limits: _Limits, period: float):
        self._limits, self._period = limits, period
        self.memory = Memory(
            state=np.zeros(2 * n),  # as it was given at the last tick
            wrench=np.zeros(6),
            state_way=0.0,  # of D since the signal has changed [m, rad]
            wrench_way=0.0,
            felt=0.0,  # when there was the last valid wrench [s]
            blind=0.0,  # 1 from when there was none for too long on: it brakes once
        )

    def missing(self, now: Now, memory: Array) -> str | None:
        """Returns what there is none of at this instant, in words, None for nothing."""
        return self.missing_reading(now, memory) or self._missing_wrench(now, memory)

    def missing_reading(self, now: Now, memory: Array) -> str | None:
        """Returns the same of the joints alone; E's measured motion stands for them if it must."""
        has_state = now.has("estimated_state")
        reading = now["estimated_state" if has_state else "measured_motion"]
        if not now["valid"][0] or not is_finite(reading):
            return "valid reading"
        is_stuck = has_state and self._is_stuck("state", reading, memory)
        return "new reading" if is_stuck else None

    def _missing_wrench(self, now: Now, memory: Array) -> str | None:
        if not is_finite(now["wrench"]):
            return "valid wrench"
        return "new wrench" if self._is_stuck("wrench", now["wrench"], memory) else None

    def _is_stuck(self, name: str, value: Array, memory: Array) -> bool:
        way = memory[getattr(self.memory, f"{name}_way")]
        return bool(way > self._limits.stuck) and self._repeats(name, value, memory)

    def _repeats(self, name: str, value: Array, memory: Array) -> bool:
        is_same = np.array_equal(value, memory[getattr(self.memory, name)])
        return is_same and bool(value.any())

    def is_blinded(self, now: Now, memory: Array, hold: float) -> bool:
        """Whether from now on the wrench counts as zero, so that D must not press any more.

        Args:
            now: the inputs.
            memory: of this piece, written.
            hold: longest time without a valid wrench [s].
        """
        if self._missing_wrench(now, memory) is None:
            memory[self.memory.felt] = now.time
        was_blind = memory[self.memory.blind]
        memory[self.memory.blind] = float(was_blind or now.time - memory[self.memory.felt] > hold)
        return bool(memory[self.memory.blind] > was_blind)

    def write_state(self, now: Now, memory: Array, state: Array) -> None:
        """Writes the joints' reading, or the last one that there was."""
        last = memory[self.memory.state]
        is_lost = last.any() and self.missing_reading(now, memory)
        state[:] = last if is_lost else now["estimated_state"]

    def write_wrench(self, now: Now, memory: Array, wrench: Array) -> None:
        """Writes the wrench within its limits, or the last one, or in the end none."""
        if self._missing_wrench(now, memory):
            wrench[:] = 0.0 if memory[self.memory.blind] else memory[self.memory.wrench]
            return
        wrench[:] = now["wrench"]
        limits = self._limits.moment, self._limits.force
        for part, limit in zip((wrench[:3], wrench[3:]), limits, strict=True):
            length = float(np.sqrt(part @ part))
            if length > limit:
                part *= limit / length

    def keep(self, now: Now, memory: Array, D: Array) -> None:
        """Keeps what has been given, and how far D moves on without a change in it.

        Args:
            now: the inputs.
            memory: of this piece.
            D: its motion (19,).
        """
        way = self._period * float(np.sqrt(D[VELOCITY] @ D[VELOCITY]))
        for name, signal in (("state", "estimated_state"), ("wrench", "wrench")):
            if now.has(signal):
                place = getattr(self.memory, f"{name}_way")
                is_same = self._repeats(name, now[signal], memory)
                memory[place] = memory[place] + way if is_same else 0.0
        given = memory.copy()
        if now.has("estimated_state"):
            self.write_state(now, given, memory[self.memory.state])
        self.write_wrench(now, given, memory[self.memory.wrench])
