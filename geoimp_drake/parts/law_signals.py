"""What laws take and find, in arrays that stay: a call passes none, and takes no memory.

These objects belong to a context, as a workspace or as what is found; a copy has arrays of its own.
Where memory and inputs stay, as in a `PartLoop`, their own arrays are taken and nothing is copied.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from geoimp_drake.arm.control_model import TASK_DIMENSION
from geoimp_drake.compilation.compiled import bound
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE, FRAME_STATE_SIZE
from geoimp_drake.laws.impedance.compliant_motion import frame_state_rate
from geoimp_drake.laws.motion_control.inverse_dynamics import peak_effort
from geoimp_drake.laws.motion_control.joint_reading import next_reading
from geoimp_drake.typing import Array

__all__ = ["ArmSignals", "ImpedanceSignals", "ReadingSignals"]


class ReadingSignals:
    """Those of `next_reading`.

    Args:
        n: number of joints.
        differenced: see the law.
        turns: see the law.
        state: array of that name, a new one by default.
        held: the same.

    Attributes:
        state: of the joints (2n,).
        held: the reading and the count behind it (2n + 1,).
        law: moves the reading on by a period.
    """

    def __init__(
        self,
        n: int,
        differenced: bool,
        turns: Array,
        state: Array | None = None,
        held: Array | None = None,
    ):
        self.state, self.held = _array(2 * n, state), _array(2 * n + 1, held)
        self._is_in_place = held is not None
        self.law = bound(next_reading, differenced, turns, self.state, self.held, self.held)

    def take(self, state: Array, memory: Array, period: float) -> bool:
        """Moves a reading with its count (2n + 1,) on by a period; returns what the law does."""
        if self._is_in_place:
            return bool(self.law(period))
        self.state[:] = state
        self.held[:] = memory
        is_taken = bool(self.law(period))
        memory[:] = self.held
        return is_taken


class ImpedanceSignals:
    """Those of `compliant_motion`.

    Args:
        law: that of a family.
        gains: as the law takes them.
        desired: array of that name, a new one by default.
        wrench: the same.

    Attributes:
        state: of C (13,).
        desired: motion of D (19,).
        wrench: at the end effector (6,).
        motion: of C (19,).
        rate: of C's state (13,).
        law: writes `motion`.
        write_rate: writes `rate`.
    """

    def __init__(
        self,
        law: Callable[..., bool],
        gains: tuple[Array, ...],
        desired: Array | None = None,
        wrench: Array | None = None,
    ):
        self.state, self.rate = np.zeros((2, FRAME_STATE_SIZE))
        self.desired, self.wrench = _array(FRAME_MOTION_SIZE, desired), _array(6, wrench)
        self.motion = np.zeros(FRAME_MOTION_SIZE)
        self._given, self._gains = gains, tuple(np.array(gain) for gain in gains)
        signals = self.state, self.desired, self.wrench, *self._gains, self.motion
        self.law = bound(law, *signals)
        self.write_rate = bound(frame_state_rate, self.motion, self.rate)

    def take(self, desired: Array, wrench: Array, state: Array, gains: tuple[Array, ...]) -> None:
        """Takes the inputs of one evaluation; arguments as of the law."""
        if desired is not self.desired:
            self.desired[:] = desired
        if wrench is not self.wrench:
            self.wrench[:] = wrench
        self.state[:] = state
        if gains is not self._given:
            self._given = gains
            for own, given in zip(self._gains, gains, strict=True):
                own[:] = given


class ArmSignals:
    """Those of `arm_torque`, or of `redundant_arm_torque`.

    Args:
        law: one of these.
        constants: what it takes before its signals.
        n: number of joints.
        efforts: limits of the torques, in the order of the actuators (n,).
        reference: array of that name, a new one by default.
        reading: the same.
        wrench: the same.
        peak: the largest efforts so far, as shares of their limits (n,).

    Attributes:
        reading: of the joints (2n,).
        reference: motion to be tracked (19,).
        wrench: at the end effector (6,).
        u: torques in the order of the actuators (n,).
        terms: of a redundant arm: gradient of the task function and its rate (n,), and e_n with
            `null_space_decay_bound` (n + 1,).
        law: writes `u` and the last of the terms.
    """

    def __init__(
        self,
        law: Callable[..., int],
        constants: tuple[Any, ...],
        n: int,
        efforts: Array,
        reference: Array | None = None,
        reading: Array | None = None,
        wrench: Array | None = None,
        peak: Array | None = None,
    ):
        self.reading, self.wrench, self.u = _array(2 * n, reading), _array(6, wrench), np.zeros(n)
        self.reference = _array(FRAME_MOTION_SIZE, reference)
        self._is_read, self._is_compared = reading is not None, peak is not None
        sizes = (n, n, n + 1) if n > TASK_DIMENSION else ()
        self.terms: tuple[Array, ...] = tuple(np.zeros(size) for size in sizes)
        signals = self.reading, self.reference, self.wrench, self.u, *self.terms
        self.law = bound(law, *constants, *signals)
        self._peak = _array(n, peak)
        self._compare = bound(peak_effort, self.u, efforts, self._peak)

    def take(self, memory: Array, place: slice) -> None:
        """Takes the reading at a place of a memory."""
        if not self._is_read:
            self.reading[:] = memory[place]

    def compare(self, memory: Array, place: slice) -> int:
        """Moves the largest efforts at a place of a memory on; returns what `peak_effort` does."""
        if self._is_compared:
            return self._compare()
        self._peak[:] = memory[place]
        passed = self._compare()
        memory[place] = self._peak
        return passed


def _array(size: int, given: Array | None) -> Array:
    return np.zeros(size) if given is None else given
