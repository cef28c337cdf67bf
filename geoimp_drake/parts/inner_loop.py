"""The inner loop of one arm: from its reading, a reference motion and the wrench to the torques."""

from collections.abc import Callable, Mapping

import numpy as np

from geoimp_drake.arm.control_model import TASK_DIMENSION, ControlModel
from geoimp_drake.errors import SignalError
from geoimp_drake.laws.compositions.arm_torque import (
    BOUND,
    UNUSABLE,
    arm_torque,
    redundant_arm_torque,
)
from geoimp_drake.laws.frame_motion import QUATERNION, is_finite
from geoimp_drake.laws.motion_control.resolved_acceleration import check_regular
from geoimp_drake.parts.arm_workspace import ArmWorkspace
from geoimp_drake.parts.constrained_torque import ConstrainedTorque
from geoimp_drake.parts.joint_limits import UNLIMITED, JointLimits
from geoimp_drake.parts.joint_readings import Readings
from geoimp_drake.parts.law_signals import ArmSignals
from geoimp_drake.parts.motion_control import MotionControl
from geoimp_drake.parts.null_space import NullSpace
from geoimp_drake.parts.part import NOTHING, Memory, Now, Output, held, nested
from geoimp_drake.parts.read_arm import ReadArm
from geoimp_drake.parts.remedies import Remedies
from geoimp_drake.parts.signals import check_frame_motion, check_signal
from geoimp_drake.parts.torque import Saturation
from geoimp_drake.parts.within import Within
from geoimp_drake.typing import Array

__all__ = ["InnerLoop"]


class InnerLoop(ReadArm):
    """Evaluates the laws of five blocks in series, those behind the reading in one compiled call.

        JointReadings ─▶ ArmModel ─▶ MotionController ─▶ RedundancyResolver
                                                      ─▶ InverseDynamicsInnerLoop

    The laws are the blocks' own (laws/compositions/arm_torque.py). This class is a piece of other
    parts; its inputs are `estimated_state`, `reference_motion` and `wrench`.

    Args:
        model: the arm.
        readings: how the joints are read.
        motion: gains and law of the motion loop.
        null_space: of an arm of more than six joints.
        limits: of the arm.
        arm: its number if there are several, from one on; the inputs' names then end with it.
        remedies: against errors of the model; None for none.

    Attributes:
        is_redundant: whether it has more than six joints.
        is_plain: whether its laws alone make the torques, without task, domain and remedies.
        orientation_law: of the motion loop.
        memory: what has been read, the posture at the start, the largest torques, what the limits
            do, and the memory of the remedies.
        limits: of the arm.
        limited: place of `Limited` in the memory.
        acts: place in the memory that is not zero while a limit acts.
    """

    def __init__(
        self,
        model: ControlModel,
        readings: Readings,
        motion: MotionControl,
        null_space: NullSpace,
        limits: JointLimits,
        arm: int = 0,
        remedies: Remedies | None = None,
    ):
        n, suffix = model.num_joints, f"_{arm}" if arm else ""
        self._place = max(arm - 1, 0)
        self._names = {name: name + suffix for name in ("reference_motion", "wrench")}
        self._label = f", arm {arm}" if arm else ""
        self.is_redundant = n > TASK_DIMENSION
        self.is_plain = not self.is_redundant and remedies is None and not motion.has_domain
        self._motion, self._null_space, self._saturation = motion, null_space, Saturation(model)
        self._remedies = remedies
        self.memory = Memory(
            readings=readings.memory,
            posture=null_space.memory,
            peak=self._saturation.memory,
            limits=limits.memory,
            remedies=Memory() if remedies is None else remedies.memory,
        )
        super().__init__(model, readings, self.memory, f"estimated_state{suffix}")
        self.limited = nested(self.memory.limits, limits.memory.limited)
        self._acts = self.memory.limits.start + limits.memory.acts
        self.acts = slice(self._acts, self._acts + 1)
        self.orientation_law = law = motion.orientation_law
        self.limits = limits
        self._constants = *self.chain, model.actuation_order, *motion.gains, *limits.arguments
        self._law: Callable[..., int] = arm_torque(law)
        if self.is_redundant:
            self._law = redundant_arm_torque(n, law)
            self._constants += (null_space.arguments,)
        self._none = np.zeros(n)
        self._constrained = ConstrainedTorque(model, self._dynamics, motion, null_space, limits)

    def new_workspace(self) -> ArmWorkspace:
        """Returns a context of the model's plant, and where a reading is taken."""
        return ArmWorkspace(self.model, self.readings)

    def new_signals(
        self,
        reference: Array | None = None,
        memory: Array | None = None,
        wrench: Array | None = None,
    ) -> ArmSignals:
        """Returns what `write_torque` takes and writes.

        Args:
            reference: array of the motion to be tracked (19,), a new one by default.
            memory: of this part, if it persists.
            wrench: array of the wrench (6,), a new one by default.
        """
        n, efforts = self.model.num_joints, self._saturation.limits
        reading = None if memory is None else memory[self._reading]
        peak = None if memory is None else memory[self.memory.peak]
        own = reference, reading, wrench, peak
        return ArmSignals(self._law, self._constants, n, efforts, *own)

    def stay(self, memory: Array, inputs: Mapping[str, Array]) -> ArmWorkspace:
        """Does what `new_workspace` does, for persistent memory and inputs."""
        return ArmWorkspace(
            self.model, self.readings, inputs[self._port], memory[self.memory.readings]
        )

    def start(self, memory: Array, now: Now) -> None:
        """Takes the first reading; targets of a task function may start from its posture."""
        self.readings.start(memory[self.memory.readings], now, self._port)
        q = memory[self.memory.readings][self.model.state_order[: self.model.num_joints]]
        self._null_space.keep_start(memory[self.memory.posture], q)
        reading = memory[self.memory.readings][self.readings.memory.reading]
        if self.limits.is_on and is_finite(reading):
            self._rehearse(memory, now)

    def _rehearse(self, memory: Array, now: Now) -> None:
        """Calls the laws of a binding limit once, so that no tick waits for a compiler."""
        signals = self.new_signals(self.motion(memory, now))
        signals.take(memory, self._reading)
        self._constrained.write(signals)

    def sample(self, memory: Array, now: Now) -> None:
        """Takes another reading; from then on, adds what remedies have found."""
        signals = now.workspace[self._place].reading
        self.readings.take(memory, self._readings, now, self._port, signals)
        if self._remedies is not None:
            self._remedies.sample(memory[self.memory.remedies], now)

    def write_torque(
        self, now: Now, memory: Array, signals: ArmSignals
    ) -> tuple[Array, float, float, Array]:
        """Writes the torques; returns e_n, w, `null_space_decay_bound` and `Limited`.

        The first three are zero for six joints.

        Args:
            now: has the time and the ports' names.
            memory: of this part, with a reading.
            signals: `reference` and `wrench` have been written; `u` is found.

        Raises:
            SignalError: a signal is NaN or infinite, or the reference's quaternion is not unit.
            SingularityError: six joints exactly singular without limits, or the attitude leaves
                the domain of the orientation law.
        """
        if self._motion.has_domain:
            self._check_domain(now, memory, signals.reference)
        signals.take(memory, self._reading)
        if not self.is_redundant:
            return self._none, 0.0, 0.0, self._resolve(now, signals)
        x = signals.reading[self.model.state_order]
        task = self._null_space.evaluate_task(
            memory[self.memory.posture],
            now.time,
            now.workspace[self._place],
            x,
            lambda: self._dynamics.evaluate(None, x),
        )
        gradient, gradient_rate, error = signals.terms
        gradient[:] = task.gradient
        gradient_rate[:] = task.gradient_rate
        limited = self._resolve(now, signals)
        return error[:-1], task.value, float(error[-1]), limited

    def outputs(self, place: slice, suffix: str = "") -> list[Output]:
        """Returns the outputs of what is remembered; their names end with `suffix`.

        Args:
            place: of this part's memory in that of the whole.
            suffix: of the names.
        """
        peak, reports = self.memory.peak, []
        if self.limits.is_on:
            reports.append(held(f"limited{suffix}", nested(place, self.limited)))
        if self._remedies is not None:
            own, places = self.memory.remedies, self._remedies.memory
            peak = nested(own, places.peak)
            added = nested(place, own, places.compensation)
            reports.append(held(f"compensation{suffix}", added))
        return [held(f"peak_effort{suffix}", nested(place, peak)), *reports]

    def actuation(self, memory: Array, signals: ArmSignals) -> Array:
        """Returns the torques that the law has written, with what remedies add (n,).

        Args:
            memory: of this part.
            signals: of `write_torque`.
        """
        if self._remedies is None:
            return signals.u
        return self._remedies.actuation(memory[self.memory.remedies], signals.u)

    def compare_with_limits(
        self, memory: Array, signals: ArmSignals, bound: float, limited: Array, now: Now
    ) -> None:
        """Remembers the effect of limits and the largest torques, finds what remedies add; warns.

        It warns of a limit that acts, of saturation, and of a K_n that is too large.

        Args:
            memory: of this part, updated.
            signals: with the requested torques.
            bound: what `write_torque` has returned for K_n [1/s].
            limited: `Limited` (10,).
            now: has the time and the system's name.
        """
        if limited is not UNLIMITED or memory[self._acts]:
            place = memory[self.memory.limits]
            self.limits.keep(place, limited, now.system + self._label, now.time)
        if self._remedies is not None:
            self._remedy(memory, signals, now)
        elif passed := signals.compare(memory, self.memory.peak):
            self.warn(passed, signals, now)
        if self._null_space.watch is not None:
            self._null_space.check_gain(
                memory[self.memory.posture],
                bound,
                lambda: self._arm(memory[self.memory.readings]),
                now.system + self._label,
                now.time,
            )

    def warn(self, passed: int, signals: ArmSignals, now: Now) -> None:
        """Warns of joints that saturate; `passed` is what `peak_effort` returns."""
        saturated = self._saturation.which(passed)
        self._saturation.report(saturated, signals.u, now.system + self._label, now.time)

    def _remedy(self, memory: Array, signals: ArmSignals, now: Now) -> None:
        """Finds what remedies add in the step that begins."""
        if self._remedies is None:
            return
        given = {
            "torque": signals.u,
            "estimated_state": signals.reading,
            "reference_motion": signals.reference,
            "wrench": signals.wrench,
        }
        view = Within(now, {}, given, label=self._label)
        self._remedies.begin(memory[self.memory.remedies], NOTHING, view)

    def _check_domain(self, now: Now, memory: Array, reference: Array) -> None:
        port = now.port(self._names["reference_motion"])
        self._motion.check(reference, self.motion(memory, now)[QUATERNION], port)

    def _resolve(self, now: Now, signals: ArmSignals) -> Array:
        """Writes the torques, within the limits if one binds; returns `Limited`."""
        try:
            outcome = signals.law()
        except np.linalg.LinAlgError:
            check_regular(self._jacobian(signals.reading))
            raise
        if outcome == UNUSABLE:
            self._check(now, signals)
        return self._constrained.write(signals) if outcome == BOUND else UNLIMITED

    def _check(self, now: Now, signals: ArmSignals) -> None:
        """Raises the error of the signal or posture that the law cannot use, with its port."""
        check_signal(signals.reading, now.port(self._port))
        check_frame_motion(signals.reference, now.port(self._names["reference_motion"]))
        check_signal(signals.wrench, now.port(self._names["wrench"]))
        check_regular(self._jacobian(signals.reading))
        raise SignalError(f"{now.system}{self._label}: the joint accelerations are not finite.")
