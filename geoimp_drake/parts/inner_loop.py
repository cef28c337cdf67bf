"""The inner loop of one arm: from its reading, a reference motion and the wrench to the torques."""

from collections.abc import Callable, Mapping

import numpy as np

from geoimp_drake.arm.control_model import TASK_DIMENSION, ControlModel
from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.arm.state import ArmState
from geoimp_drake.compilation.compiled import bound, compiled
from geoimp_drake.errors import SignalError
from geoimp_drake.laws.compositions.arm_quantities import measured_motion
from geoimp_drake.laws.compositions.arm_torque import (
    BOUND,
    UNUSABLE,
    arm_torque,
    redundant_arm_torque,
)
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE, QUATERNION, is_finite
from geoimp_drake.laws.motion_control.inverse_dynamics import actuation
from geoimp_drake.laws.motion_control.resolved_acceleration import check_regular
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import smallest_singular_value
from geoimp_drake.laws.redundancy.redundant_acceleration import redundant_acceleration
from geoimp_drake.parts.arm_workspace import ArmWorkspace
from geoimp_drake.parts.joint_limits import UNLIMITED, JointLimits
from geoimp_drake.parts.joint_readings import Readings
from geoimp_drake.parts.law_signals import ArmSignals
from geoimp_drake.parts.motion_control import MotionControl
from geoimp_drake.parts.null_space import NullSpace
from geoimp_drake.parts.part import NOTHING, Memory, Now, Output, held, nested
from geoimp_drake.parts.remedies import Remedies
from geoimp_drake.parts.signals import check_frame_motion, check_signal
from geoimp_drake.parts.torque import Saturation
from geoimp_drake.parts.within import Within
from geoimp_drake.typing import Array

__all__ = ["InnerLoop"]


class InnerLoop:
    """Evaluates the laws of five blocks in series in one compiled call.

        JointReadings ─▶ ArmModel ─▶ MotionController ─▶ RedundancyResolver
                                                      ─▶ InverseDynamicsInnerLoop

    The laws are the blocks' own (laws/compositions/arm_torque.py). It is a piece of other parts;
    its inputs are `estimated_state`, `reference_motion` and `wrench`.

    Args:
        model: the arm.
        readings: how the joints are read.
        motion: gains and law of the motion loop.
        null_space: of an arm of more than six joints.
        limits: of the arm.
        arm: its number where there are several, from one on; then the inputs' names end with it.
        remedies: against what the model does not know; None for none.

    Attributes:
        model: the arm.
        readings: how the joints are read.
        is_redundant: whether it has more than six joints.
        memory: what has been read, the posture at the start, the largest torques.
        limits: of the arm.
        limited: place of `Limited` in the memory.
        count: place in the memory that is zero until there has been a reading.
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
        n = model.num_joints
        self.model, self.readings = model, readings
        suffix = f"_{arm}" if arm else ""
        self._port, self._place = f"estimated_state{suffix}", max(arm - 1, 0)
        self._names = {name: name + suffix for name in ("reference_motion", "wrench")}
        self._label = f", arm {arm}" if arm else ""
        self.is_redundant = n > TASK_DIMENSION
        self._motion, self._null_space, self._saturation = motion, null_space, Saturation(model)
        self._remedies = remedies
        self.memory = Memory(
            readings=readings.memory,
            posture=null_space.memory,
            peak=self._saturation.memory,
            limits=limits.memory,
            remedies=Memory() if remedies is None else remedies.memory,
        )
        self.limited = nested(self.memory.limits, limits.memory.limited)
        self._acts = self.memory.limits.start + limits.memory.acts
        self.count: int = self.memory.readings.start + readings.memory.count
        law = motion.orientation_law
        self.limits = limits
        self._dynamics = ChainDynamics(model)
        chain = *self._dynamics.arguments, model.state_order
        self._constants = *chain, model.actuation_order, *motion.gains, *limits.arguments
        self._law: Callable[..., int] = arm_torque(law)
        if self.is_redundant:
            self._law = redundant_arm_torque(n, law)
            self._constants += (null_space.arguments,)
        self._none = np.zeros(n)
        self._reading = nested(self.memory.readings, readings.memory.reading)
        self._measured, self._actuation = bound(measured_motion, *chain), compiled(actuation)

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
            memory: of this part, if it stays.
            wrench: array of the wrench (6,), a new one by default.
        """
        n, efforts = self.model.num_joints, self._saturation.limits
        reading = None if memory is None else memory[self._reading]
        peak = None if memory is None else memory[self.memory.peak]
        own = reference, reading, wrench, peak
        return ArmSignals(self._law, self._constants, n, efforts, *own)

    def stay(self, memory: Array, inputs: Mapping[str, Array]) -> ArmWorkspace:
        """Does what `new_workspace` does, for memory and inputs that stay."""
        return ArmWorkspace(
            self.model, self.readings, inputs[self._port], memory[self.memory.readings]
        )

    def start(self, memory: Array, now: Now) -> None:
        """Takes the first reading, whose posture is the one from which targets may start."""
        self.readings.start(memory[self.memory.readings], now, self._port)
        q = memory[self.memory.readings][self.model.state_order[: self.model.num_joints]]
        self._null_space.keep_start(memory[self.memory.posture], q)
        reading = memory[self.memory.readings][self.readings.memory.reading]
        if self.limits.is_on and is_finite(reading):
            self._rehearse(memory, now)

    def _rehearse(self, memory: Array, now: Now) -> None:
        """Calls what a limit that binds calls, so that no tick waits for a compiler."""
        signals = self.new_signals(self.motion(memory, now))
        signals.take(memory, self._reading)
        self._constrain(signals)

    def sample(self, memory: Array, now: Now) -> None:
        """Takes another reading."""
        signals = now.workspace[self._place].reading
        self.readings.take(memory[self.memory.readings], now, self._port, signals)
        if self._remedies is not None:
            self._remedies.sample(memory[self.memory.remedies], now)

    def has_reading(self, memory: Array) -> bool:
        """Whether there has been a reading."""
        return bool(memory[self.count])

    def pass_through(self, memory: Array, now: Now) -> Array:
        """Returns a memory with a reading: before the first one, that of the port.

        Args:
            memory: of this part, which may be written.
            now: the inputs.
        """
        self.readings.held(memory[self.memory.readings], now, self._port)
        return memory

    def write_motion(self, memory: Array, now: Now, motion: Array) -> None:
        """Writes the motion of E in W from the reading, with zero accelerations.

        Args:
            memory: of this part, with a reading.
            now: has the ports' names.
            motion: where to write (19).

        Raises:
            SignalError: the reading is NaN or infinite.
        """
        reading = memory[self.memory.readings]
        if not self._measured(reading, motion):
            self._check_reading(memory, now)

    def motion(self, memory: Array, now: Now) -> Array:
        """Returns what `write_motion` writes (19,)."""
        motion = np.empty(FRAME_MOTION_SIZE)
        self.write_motion(memory, now, motion)
        return motion

    def arm_state(self, memory: Array, now: Now) -> ArmState:
        """Returns kinematics and dynamics; arguments and errors as of `write_motion`."""
        self._check_reading(memory, now)
        return self._arm(memory[self.memory.readings])

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
            Within(now, {}, {}, place=self._place),
            x,
            lambda: self._dynamics.evaluate(None, x),
        )
        gradient, gradient_rate, error = signals.terms
        gradient[:] = task.gradient
        gradient_rate[:] = task.gradient_rate
        limited = self._resolve(now, signals)
        return error[:-1], task.value, float(error[-1]), limited

    def outputs(self, place: slice, suffix: str = "") -> list[Output]:
        """Returns those of what is remembered, whose names end with `suffix`.

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

    def smallest_singular_value(self, memory: Array, now: Now) -> float:
        """Returns that of the Jacobian of E, in rad and m.

        Args:
            memory: of this part, with a reading.
            now: has the ports' names.

        Raises:
            SignalError: the reading is NaN or infinite.
        """
        return float(smallest_singular_value(self.arm_state(memory, now).Jv_V_WE))

    def compare_with_limits(
        self, memory: Array, signals: ArmSignals, bound: float, limited: Array, now: Now
    ) -> None:
        """Remembers what limits do and the largest torques, finds what remedies add; warns.

        That is a limit that acts, a saturation, and a K_n that is too large.

        Args:
            memory: of this part, moved on.
            signals: with the torques that are requested.
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
            saturated = self._saturation.which(passed)
            self._saturation.report(saturated, signals.u, now.system + self._label, now.time)
        if self._null_space.watch is not None:
            self._null_space.check_gain(
                memory[self.memory.posture],
                bound,
                lambda: self._arm(memory[self.memory.readings]),
                now.system + self._label,
                now.time,
            )

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

    def _arm(self, readings: Array) -> ArmState:
        return self._dynamics.evaluate(None, readings[self.model.state_order])

    def _jacobian(self, readings: Array) -> Array:
        return self._arm(readings).Jv_V_WE

    def _check_reading(self, memory: Array, now: Now) -> None:
        reading = memory[self.memory.readings][self.readings.memory.reading]
        check_signal(reading, now.port(self._port))

    def _check_domain(self, now: Now, memory: Array, reference: Array) -> None:
        port = now.port(self._names["reference_motion"])
        self._motion.check(reference, self.motion(memory, now)[QUATERNION], port)

    def _resolve(self, now: Now, signals: ArmSignals) -> Array:
        """Writes the torques; returns `Limited`."""
        try:
            outcome = signals.law()
        except np.linalg.LinAlgError:
            check_regular(self._jacobian(signals.reading))
            raise
        if outcome == UNUSABLE:
            self._check(now, signals)
        return self._constrain(signals) if outcome == BOUND else UNLIMITED

    def _constrain(self, signals: ArmSignals) -> Array:
        """Writes torques within the limits; returns `Limited`."""
        reference, h, u, terms = signals.reference, signals.wrench, signals.u, signals.terms
        arm = self._arm(signals.reading)
        a = self._motion.acceleration(reference, arm)
        alpha_0 = self._none
        if self.is_redundant:
            J_pinv, alpha_n, terms[2][:-1], terms[2][-1] = self._dynamics.null_space(
                None, arm, (terms[0], terms[1]), self._null_space.arguments
            )
            alpha_0 = redundant_acceleration(J_pinv, a, arm.Jdot_v, alpha_n)
        alpha, limited = self.limits.constrained(arm, h, a, alpha_0)
        order = self.model.actuation_order
        self._actuation(arm.B, alpha, arm.Cv, arm.Fv, arm.g, arm.Jv_V_WE, h, order, u)
        return limited

    def _check(self, now: Now, signals: ArmSignals) -> None:
        """Raises SignalError, with the port's name, if the law cannot use a signal."""
        check_signal(signals.reading, now.port(self._port))
        check_frame_motion(signals.reference, now.port(self._names["reference_motion"]))
        check_signal(signals.wrench, now.port(self._names["wrench"]))
        check_regular(self._jacobian(signals.reading))
        raise SignalError(f"{now.system}{self._label}: the joint accelerations are not finite.")
