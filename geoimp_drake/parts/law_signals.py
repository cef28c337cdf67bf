"""Inputs and results of laws, in persistent arrays: a call passes none, and takes no memory.

These objects belong to a context, as its `workspace` or its `found`; a copy has arrays of its own.
Where memory and inputs persist, as in a `PartLoop`, the laws use their arrays and nothing is
copied.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from geoimp_drake.arm.control_model import TASK_DIMENSION
from geoimp_drake.compilation.compiled import bound
from geoimp_drake.laws.compositions.arm_quantities import measured_motion
from geoimp_drake.laws.compositions.impedance_step import impedance_step
from geoimp_drake.laws.cooperation.grasp_watch import watch_grasps
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE, FRAME_STATE_SIZE
from geoimp_drake.laws.motion_control.inverse_dynamics import peak_effort
from geoimp_drake.laws.motion_control.joint_reading import next_reading
from geoimp_drake.typing import Array

__all__ = ["ArmSignals", "ImpedanceSignals", "KeptGains", "ReadingSignals", "WatchSignals"]


class ReadingSignals:
    """The signals of `next_reading`.

    Args:
        n: number of joints.
        differenced: see the law.
        turns: see the law.
        state: the array of this attribute, a new one by default.
        held: the same.

    Attributes:
        state: of the joints (2n,).
        held: the reading and the count behind it (2n + 1,).
        arguments: the fixed ones of the law.
        law: advances the reading by a period.
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
        self.arguments = differenced, turns, self.state, self.held, self.held
        self.law: Callable[[float], bool] = bound(next_reading, *self.arguments)

    def take(self, state: Array, memory: Array, place: slice, period: float) -> bool:
        """Advances a reading by a period, with its count (2n + 1,) at a place of a memory.

        Returns what the law returns.
        """
        if self._is_in_place:
            return self.law(period)
        self.state[:] = state
        self.held[:] = memory[place]
        is_taken = self.law(period)
        memory[place] = self.held
        return is_taken


class KeptGains:
    """Gains of an impedance in arrays that persist; only other gains are copied into them.

    Args:
        gains: as `compliant_motion` takes them.

    Attributes:
        arrays: the same, in memory of their own.
    """

    def __init__(self, gains: tuple[Array, ...]):
        self._given, self.arrays = gains, tuple(np.array(gain) for gain in gains)

    def take(self, gains: tuple[Array, ...]) -> None:
        """Takes other gains, recognized by their identity."""
        if gains is not self._given:
            self._given = gains
            for own, given in zip(self.arrays, gains, strict=True):
                own[:] = given


class WatchSignals:
    """The signals of `watch_grasps`.

    Args:
        thresholds: see the law.
        limits: see the law.
        period: see the law.

    Attributes:
        new: which hands have just opened (2,).
        law: advances the times by a period.
    """

    def __init__(self, thresholds: Array, limits: Array, period: float):
        # No views of one array: a copy of this object would separate them from the law's arguments.
        self._h_1, self._h_2 = np.zeros(6), np.zeros(6)
        self._times, self.new = np.zeros(4), np.zeros(2)
        given = self._h_1, self._h_2, self._times, thresholds, limits, period
        self.law: Callable[[], bool] = bound(watch_grasps, *given, self._times, self.new)

    def take(self, h_1: Array, h_2: Array, times: Array) -> bool:
        """Advances times (4,) by a period; returns what the law returns."""
        self._h_1[:], self._h_2[:], self._times[:] = h_1, h_2, times
        is_taken = self.law()
        times[:] = self._times
        return is_taken


class ImpedanceSignals:
    """The signals of `impedance_step`.

    Args:
        family: the law of an orientation family.
        gains: as the law takes them.
        desired: the array of this attribute, a new one by default.
        wrench: the same.
        state: the same.
        rate: the same.

    Attributes:
        state: of C (13,).
        desired: motion of D (19,).
        wrench: at the end effector (6,).
        motion: of C (19,).
        rate: of C's state (13,).
        arguments: what the law takes.
        law: writes `motion` and `rate`.
    """

    def __init__(
        self,
        family: Callable[..., Array],
        gains: tuple[Array, ...],
        desired: Array | None = None,
        wrench: Array | None = None,
        state: Array | None = None,
        rate: Array | None = None,
    ):
        self.state, self.rate = _array(FRAME_STATE_SIZE, state), _array(FRAME_STATE_SIZE, rate)
        self.desired, self.wrench = _array(FRAME_MOTION_SIZE, desired), _array(6, wrench)
        self.motion = np.zeros(FRAME_MOTION_SIZE)
        self._gains = KeptGains(gains)
        signals = self.state, self.desired, self.wrench, *self._gains.arrays, self.motion
        self.arguments = *signals, self.rate
        self.law = bound(impedance_step(family), *self.arguments)

    def take(self, desired: Array, wrench: Array, state: Array, gains: tuple[Array, ...]) -> None:
        """Copies the inputs of one evaluation if not in place; arguments as of the law."""
        if desired is not self.desired:
            self.desired[:] = desired
        if wrench is not self.wrench:
            self.wrench[:] = wrench
        if state is not self.state:
            self.state[:] = state
        self._gains.take(gains)


class ArmSignals:
    """The signals of `arm_torque`, or of `redundant_arm_torque`.

    Args:
        law: one of these.
        constants: its arguments before the signals; the first three are those of `measured_motion`.
        n: number of joints.
        efforts: limits of the torques, in the order of the actuators (n,).
        reference: the array of this attribute, a new one by default.
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
        arguments: what the law takes.
        efforts: what `peak_effort` takes.
        law: writes `u` and the last of the terms.
        motion: of E as measured (19,).
        measure: writes `motion`, see `measured_motion`.
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
        self.arguments = *constants, *signals
        self.law = bound(law, *self.arguments)
        self.motion = np.zeros(FRAME_MOTION_SIZE)
        self.measure = bound(measured_motion, *constants[:3], self.reading, self.motion)
        self._peak = _array(n, peak)
        self.efforts = self.u, efforts, self._peak
        self._compare = bound(peak_effort, *self.efforts)

    def take(self, memory: Array, place: slice) -> None:
        """Copies the reading from a place of a memory, unless the memory persists."""
        if not self._is_read:
            self.reading[:] = memory[place]

    def compare(self, memory: Array, place: slice) -> int:
        """Updates the largest efforts at a place of a memory; returns what `peak_effort` does."""
        if self._is_compared:
            return self._compare()
        self._peak[:] = memory[place]
        passed = self._compare()
        memory[place] = self._peak
        return passed


def _array(size: int, given: Array | None) -> Array:
    return np.zeros(size) if given is None else given
