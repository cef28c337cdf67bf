"""Joint references that a frame's motion asks of an arm that takes positions."""

import logging
from dataclasses import dataclass

import numpy as np
from pydrake.multibody.inverse_kinematics import (
    DifferentialInverseKinematicsParameters,
    DifferentialInverseKinematicsStatus,
    DoDifferentialInverseKinematics,
)

from geoimp_drake.arm.control_model import TASK_DIMENSION, ControlModel
from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.compositions.arm_quantities import measured_motion
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE
from geoimp_drake.laws.motion_control.closed_loop_inverse_kinematics import (
    pose_error,
    reference_joint_velocity,
    reference_task_velocity,
)
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import (
    SingularityDamping,
    pseudo_inverse_with,
    singular_value_or_bound,
)
from geoimp_drake.parts.part import Memory, Now, Output, held
from geoimp_drake.parts.signals import check_frame_motion, check_signal
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, key, non_negative, positive

__all__ = ["InverseKinematics", "ReferenceConfig"]

_log = logging.getLogger("drake")
_FOUND = DifferentialInverseKinematicsStatus.kSolutionFound


@dataclass
class ReferenceConfig:
    """How joint references follow C, with the scheme `admittance`."""

    gain: float = 20.0  # K_x: the reference's error decays at this rate [1/s]
    posture_gain: float = 1.0  # K_n: so does a redundant arm's way back to its first posture [1/s]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        positive(self.gain, key(name, "gain"), "1/s")
        non_negative(self.posture_gain, key(name, "posture_gain"), "1/s")

    def check_period(self, name: str, period: float) -> None:
        """Raises ConfigurationError if the error would not decay with references so rare."""
        fastest = max(self.gain, self.posture_gain)
        if fastest * period > 1.0:
            raise ConfigurationError(
                f"{name} has a gain of {fastest:g} 1/s and sampling.period is {period:g} s; the "
                f"greatest gain is 1/period = {1.0 / period:.4g} 1/s."
            )


class InverseKinematics:
    """The part of `systems.arm.inverse_kinematics.InverseKinematics`.

    Args:
        model: the arm.
        period: of the references [s].
        config: gains.
        damping: near singularities.
        has_limits: whether positions and velocities are kept within the arm's limits.

    Raises:
        ConfigurationError: a gain does not fit the period.
    """

    def __init__(
        self,
        model: ControlModel,
        period: float,
        config: ReferenceConfig | None = None,
        damping: SingularityDamping | None = None,
        *,
        has_limits: bool = True,
    ):
        config, damping = config or ReferenceConfig(), damping or SingularityDamping()
        check(config, "reference")
        config.check_period("reference", period)
        n = model.num_joints
        self.model, self.period, self._gains = model, period, config
        self._damping, self._has_limits = (damping.threshold, damping.factor), has_limits
        self._dynamics = ChainDynamics(model)
        self._measured, self._error = compiled(measured_motion), compiled(pose_error)
        self._task_velocity = compiled(reference_task_velocity)
        self._joint_velocity = compiled(reference_joint_velocity)
        self._pseudo_inverse = compiled(pseudo_inverse_with)
        self._singular_value = compiled(singular_value_or_bound)
        self.inputs = {"estimated_state": 2 * n, "reference_motion": FRAME_MOTION_SIZE}
        # [q_d; q̇_d] in the plant's order, the posture at the start from base to hand.
        self.memory = Memory(
            reference=np.zeros(2 * n),
            posture=np.zeros(n),
            error=np.zeros(TASK_DIMENSION),
            started=0.0,
            limited=0.0,
        )
        self.samplings = ((period, self.sample),)
        state = ("memory", "estimated_state")
        self.outputs = (
            Output("joint_reference", 2 * n, self.write_reference, state),
            Output("measured_motion", FRAME_MOTION_SIZE, self._write_motion, ("estimated_state",)),
            held("reference_error", self.memory.error),
        )

    def start(self, memory: Array, now: Now) -> None:
        """Takes the measured posture, at rest, as the reference."""
        reading = now["estimated_state"]
        check_signal(reading, now.port("estimated_state"))
        memory[self.memory.reference] = self._at_rest(reading)
        memory[self.memory.posture] = reading[self._q]
        memory[self.memory.started] = 1.0

    def sample(self, memory: Array, now: Now) -> None:
        """Moves the reference on by one period towards the reference motion."""
        C = now["reference_motion"]
        check_frame_motion(C, now.port("reference_motion"))
        self.advance(memory, now, C)

    def advance(self, memory: Array, now: Now, C: Array) -> None:
        """Does the same towards a motion (19,) that has been checked."""
        reference = memory[self.memory.reference]
        q = reference[self._q]
        elapsed = self.period if now.elapsed is None else now.elapsed
        v, memory[self.memory.error] = self._velocity(
            memory, C, q, reference[self._v], elapsed, now
        )
        reference[self._q] = q + elapsed * v
        reference[self._v] = v

    def motion(self, now: Now) -> Array:
        """Returns the motion of E in W (19,) from the reading, with zero accelerations."""
        motion = np.zeros(FRAME_MOTION_SIZE)
        self._write_motion(now, motion)
        return motion

    @property
    def _q(self) -> Array:
        return self.model.state_order[: self.model.num_joints]

    @property
    def _v(self) -> Array:
        return self.model.state_order[self.model.num_joints :]

    def _velocity(
        self, memory: Array, C: Array, q: Array, v: Array, elapsed: float, now: Now
    ) -> tuple[Array, Array]:
        """Returns q̇_d (n,) and the error of the pose before it (6,)."""
        arm = self._dynamics.evaluate(None, np.concatenate((q, np.zeros_like(q))))
        J = arm.Jv_V_WE
        error = self._error(C, arm.Q_WE, arm.p_WE)
        V = self._task_velocity(C, error, self._gains.gain)
        sigma = self._singular_value(J, self._damping[0])
        J_pinv, N = self._pseudo_inverse(J, np.eye(len(q)), sigma, *self._damping)
        to_posture = self._gains.posture_gain * (memory[self.memory.posture] - q)
        following = self._joint_velocity(V, J_pinv, N, to_posture)
        if not self._has_limits or self._is_within(q + elapsed * following, following):
            return following, error
        return self._within_limits(memory, V, J, q, v, elapsed, now), error

    def _is_within(self, q: Array, v: Array) -> bool:
        """Whether positions and velocities (n,) are within the limits."""
        limits = zip((q, v), (self.model.position_limits, self.model.velocity_limits), strict=True)
        return all(((low <= x) & (x <= high)).all() for x, (low, high) in limits)

    def _within_limits(
        self, memory: Array, V: Array, J: Array, q: Array, v: Array, elapsed: float, now: Now
    ) -> Array:
        """Returns the velocity (n,) within the limits that goes on as far as they let in V."""
        result = DoDifferentialInverseKinematics(q, v, V, J, self._parameters(memory, elapsed))
        if not memory[self.memory.limited]:
            memory[self.memory.limited] = 1.0
            _log.warning(
                f"{now.system}: at t = {now.time:.3f} s a joint's limit keeps the reference from "
                f"following C; see the output reference_error."
            )
        found: Array = result.joint_velocities
        return found if result.status == _FOUND else np.zeros_like(q)

    def _parameters(self, memory: Array, elapsed: float) -> DifferentialInverseKinematicsParameters:
        n = self.model.num_joints
        parameters = DifferentialInverseKinematicsParameters(n, n)
        parameters.set_time_step(elapsed)
        parameters.set_nominal_joint_position(memory[self.memory.posture])
        parameters.set_joint_centering_gain(self._gains.posture_gain * np.eye(n))
        parameters.set_joint_position_limits(tuple(self.model.position_limits))
        parameters.set_joint_velocity_limits(tuple(self.model.velocity_limits))
        return parameters

    def _at_rest(self, reading: Array) -> Array:
        reference = reading.copy()
        reference[self._v] = 0.0
        return reference

    def write_reference(self, now: Now, reference: Array) -> None:
        """Writes [q_d; q̇_d]; before the start, the measured posture at rest."""
        memory = now.memory
        started = memory[self.memory.started]
        reading = now["estimated_state"]
        reference[:] = memory[self.memory.reference] if started else self._at_rest(reading)

    def _write_motion(self, now: Now, motion: Array) -> None:
        reading = now["estimated_state"]
        if not self._measured(self.model.state_order, reading, motion, *self._dynamics.chain):
            check_signal(reading, now.port("estimated_state"))
