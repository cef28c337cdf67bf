"""What a supervised controller gets in place of an invalid reading or wrench."""

from typing import Protocol

import numpy as np

from geoimp_drake.laws.frame_motion import VELOCITY, is_finite
from geoimp_drake.parts.part import Memory, Now
from geoimp_drake.typing import Array

__all__ = ["SignalGuard"]


class _Limits(Protocol):
    force: float  # largest at E [N]
    moment: float  # largest at E [Nm]
    stuck: float  # path of D over which a signal must change [m, rad]


class SignalGuard:
    """Judges reading and wrench of a tick; in place of an invalid one it gives the last valid one.

    A signal is invalid if it is not finite, or if it has repeated itself to the bit while D moved
    by `stuck`. So is a reading while the input `valid` is zero. A wrench of exactly zero may repeat
    itself: nothing touches the hand. Without a valid wrench for too long, it gives zero. A wrench
    beyond its limit is shortened to the limit. This class is a piece of the supervisor's part.

    Args:
        n: number of joints.
        limits: largest force and moment, and the path of D over which a signal must change.
        period: of a tick [s].
    """

    def __init__(self, n: int, limits: _Limits, period: float):
        self._limits, self._period = limits, period
        self.memory = Memory(
            state=np.zeros(2 * n),  # as passed on at the last tick
            wrench=np.zeros(6),
            state_way=0.0,  # path of D since the signal has changed [m, rad]
            wrench_way=0.0,
            felt=0.0,  # time of the last valid wrench [s]
            blind=0.0,  # 1 once there has been none for too long, for good: D brakes once
        )

    def missing(self, now: Now, memory: Array) -> str | None:
        """Returns in words which signal is missing at this instant, None for nothing."""
        return self.missing_reading(now, memory) or self._missing_wrench(now, memory)

    def missing_reading(self, now: Now, memory: Array) -> str | None:
        """Returns the same for the joints alone; without their reading, for E's measured motion."""
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
        """Whether from this tick on an invalid wrench counts as zero, so that D must not press.

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
        """Writes the joints' reading, or the last valid one."""
        last = memory[self.memory.state]
        is_lost = last.any() and self.missing_reading(now, memory)
        state[:] = last if is_lost else now["estimated_state"]

    def write_wrench(self, now: Now, memory: Array, wrench: Array) -> None:
        """Writes the wrench within its limits, or the last valid one, or in the end zero."""
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
        """Keeps what has been passed on, and how far D moves without a change in it.

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
