"""Both hands come to rest when a grasp has opened, and then do what the user has chosen."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from geoimp_drake.laws.frame_motion import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
)
from geoimp_drake.laws.smooth_rest import smooth_step, stopped
from geoimp_drake.parts.part import Memory, Now, Output
from geoimp_drake.parts.signals import check_frame_motion
from geoimp_drake.rotations import quaternion
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, choice, key, non_negative, positive

__all__ = ["AFTER_HOLD", "Hold", "ReferenceHoldConfig"]

AFTER_HOLD = ("hold", "release", "retreat")


@dataclass
class ReferenceHoldConfig:
    """How the hands stop and what comes after."""

    after: str = "hold"  # or release, retreat: what follows after `delay`
    stop_time: float = 0.02  # time constant of the velocities [s]
    delay: float = 1.0  # from the hold to release or retreat [s]
    retreat_distance: float = 0.05  # of an opened hand, away from the other [m]
    retreat_duration: float = 2.0  # [s]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        choice(self.after, key(name, "after"), AFTER_HOLD)
        positive(self.stop_time, key(name, "stop_time"), "s")
        non_negative(self.delay, key(name, "delay"), "s")
        positive(self.retreat_distance, key(name, "retreat_distance"), "m")
        positive(self.retreat_duration, key(name, "retreat_duration"), "s")


class Hold:
    """The part of `ReferenceHold`; arguments and errors are the same."""

    def __init__(self, config: ReferenceHoldConfig | None = None, period: float = 1e-3):
        self._config = config or ReferenceHoldConfig()
        check(self._config, "opened")
        positive(period, "sampling.period", "s")
        names = "reference_motion_1", "reference_motion_2"
        self.inputs = {**dict.fromkeys(names, FRAME_MOTION_SIZE), "opened": 3}
        # Both references at the hold, whether there has been one, and its time [s].
        nothing = np.zeros(FRAME_MOTION_SIZE)
        self.memory = Memory(first=nothing, second=nothing, is_held=0.0, since=0.0)
        self.samplings = ((period, self.sample),)
        held = "memory", "time", "opened"
        self.outputs = (
            *(
                Output(
                    f"held_motion_{k}", FRAME_MOTION_SIZE, partial(self._write, k), (*held, name)
                )
                for k, name in enumerate(names, 1)
            ),
            Output("release", 2, self._write_release, held),
        )

    def sample(self, memory: Array, now: Now) -> None:
        """Keeps both references, from which the hands stop, at the first sample of an opened grasp.

        Raises:
            SignalError: a reference is NaN or infinite, or its quaternion is not unit.
        """
        if not self.is_due(memory, now["opened"]):
            return
        for name, place in (
            ("reference_motion_1", self.memory.first),
            ("reference_motion_2", self.memory.second),
        ):
            check_frame_motion(now[name], now.port(name))
            memory[place] = now[name]
        memory[self.memory.is_held], memory[self.memory.since] = 1.0, now.time

    def is_due(self, memory: Array, opened: Array) -> bool:
        """Whether a grasp has opened and there has been no hold."""
        return bool(opened[0] or opened[1]) and not self.is_held(memory)

    def is_held(self, memory: Array) -> bool:
        """Whether there has been a hold."""
        return bool(memory[self.memory.is_held])

    def motion(self, k: int, memory: Array, time: float, opened: Array) -> Array:
        """Returns the motion (19) of a hand after the hold.

        Args:
            k: 1 for the first hand, 2 for the second.
            memory: of this part.
            time: [s].
            opened: of `GraspMonitor` (3).
        """
        places = self.memory.first, self.memory.second
        start, other = memory[places[k - 1]], memory[places[2 - k]]
        elapsed = time - memory[self.memory.since]
        motion = _stopped_motion(start, elapsed, self._config.stop_time)
        if self._config.after == "retreat" and opened[k - 1]:
            self._retreat(motion, start[POSITION] - other[POSITION], elapsed)
        return motion

    def release(self, memory: Array, time: float, opened: Array) -> Array:
        """Returns 1 for a hand that is to open its gripper, else 0 (2).

        Args:
            memory: of this part.
            time: [s].
            opened: of `GraspMonitor` (3).
        """
        elapsed = time - memory[self.memory.since]
        due = self.is_held(memory) and elapsed >= self._config.delay
        return (1.0 - opened[:2]) * float(due and self._config.after == "release")

    def release_of(self, resting: slice, opened: slice) -> Output:
        """Returns the output `release` of a part that contains this one.

        Args:
            resting: place of this part's memory in that of the whole.
            opened: place of the opened hands in it.
        """

        def write(now: Now, value: Array) -> None:
            memory = now.memory
            value[:] = self.release(memory[resting], now.time, memory[opened])

        return Output("release", 2, write, ("memory", "time"))

    def _write(self, k: int, now: Now, motion: Array) -> None:
        memory = now.memory
        if self.is_held(memory):
            motion[:] = self.motion(k, memory, now.time, now["opened"])
        else:
            motion[:] = now[f"reference_motion_{k}"]

    def _write_release(self, now: Now, value: Array) -> None:
        value[:] = self.release(now.memory, now.time, now["opened"])

    def _retreat(self, motion: Array, p_other_W: Array, elapsed: float) -> None:
        """Adds the retreat along `p_other_W`, from the other hand to this one."""
        way = p_other_W * (self._config.retreat_distance / np.sqrt(p_other_W @ p_other_W))
        step = smooth_step(elapsed - self._config.delay, self._config.retreat_duration)
        for part, s in zip((POSITION, LINEAR_VELOCITY, LINEAR_ACCELERATION), step, strict=True):
            motion[part] += s * way


def _stopped_motion(held: Array, elapsed: float, time_constant: float) -> Array:
    """Returns the motion (19) of a frame that stops from the pose and velocity of `held`.

    Args:
        held: motion at the hold (19,).
        elapsed: time since then [s].
        time_constant: of the velocities [s].
    """
    turn, w, dw = stopped(held[ANGULAR_VELOCITY], elapsed, time_constant)
    way, v, dv = stopped(held[LINEAR_VELOCITY], elapsed, time_constant)
    motion = np.empty(FRAME_MOTION_SIZE)
    motion[QUATERNION] = quaternion.product(quaternion.exp(turn), held[QUATERNION])
    motion[POSITION] = held[POSITION] + way
    motion[ANGULAR_VELOCITY], motion[LINEAR_VELOCITY] = w, v
    motion[ANGULAR_ACCELERATION], motion[LINEAR_ACCELERATION] = dw, dv
    return motion
