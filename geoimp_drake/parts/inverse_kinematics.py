"""Joint references by which a position-controlled arm follows a frame's motion."""

from dataclasses import dataclass, replace

import numpy as np

from geoimp_drake.arm.control_model import TASK_DIMENSION, ControlModel
from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.arm.state import ArmState
from geoimp_drake.compilation.compiled import bound, compiled
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.compositions.arm_quantities import measured_motion
from geoimp_drake.laws.compositions.limit_test import limit_test
from geoimp_drake.laws.explicit_euler import steps_of
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE, VELOCITY
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
from geoimp_drake.parts.joint_limits import SLACK, UNLIMITED, JointLimits, LimitsConfig
from geoimp_drake.parts.masses import Masses
from geoimp_drake.parts.part import Memory, Now, Output, held, nested
from geoimp_drake.parts.signals import check_frame_motion, check_signal
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, key, non_negative, positive

__all__ = ["InverseKinematics", "ReferenceConfig"]

_NO_WRENCH = np.zeros(6)

# The least horizon of the limits, in periods; C takes up what they leave undone over the same time.
# With a shorter one, reference and C overshoot when a tick comes late.
_LEAST_PERIODS = 2.0


@dataclass
class ReferenceConfig:
    """How joint references follow C, with the scheme `admittance`."""

    gain: float = 20.0  # K_x: the reference's error decays at this rate [1/s]
    posture_gain: float = 1.0  # K_n: so does a redundant arm's distance from its start [1/s]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        positive(self.gain, key(name, "gain"), "1/s")
        non_negative(self.posture_gain, key(name, "posture_gain"), "1/s")

    def check_period(self, name: str, period: float) -> None:
        """Raises ConfigurationError if a gain times the period [s] exceeds 1.

        In each step the error would then change its sign.
        """
        fastest = max(self.gain, self.posture_gain)
        if fastest * period > 1.0:
            raise ConfigurationError(
                f"{name} has a gain of {fastest:g} 1/s and sampling.period is {period:g} s; the "
                f"greatest gain is 1/period = {1.0 / period:.4g} 1/s."
            )


class InverseKinematics:
    """The part of `systems.arm.inverse_kinematics.InverseKinematics`; arguments are the same.

    Attributes:
        model: the arm.
        period: of the references [s].
        slack: place in the memory of what the limits leave undone.
    """

    def __init__(
        self,
        model: ControlModel,
        period: float,
        config: ReferenceConfig | None = None,
        damping: SingularityDamping | None = None,
        limits: LimitsConfig | None = None,
        masses: Masses | None = None,
    ):
        config, damping = config or ReferenceConfig(), damping or SingularityDamping()
        limits = limits or LimitsConfig()
        check(config, "reference")
        check(limits, "limits")
        config.check_period("reference", period)
        n = model.num_joints
        self.model, self.period, self._gains = model, period, config
        limits = replace(limits, horizon=max(limits.horizon, _LEAST_PERIODS * period))
        self._limits = JointLimits(model, limits, masses, damping)
        self._damping = damping.threshold, damping.factor
        self._dynamics = ChainDynamics(model)
        self._measured = bound(measured_motion, *self._dynamics.arguments, model.state_order)
        self._error = compiled(pose_error)
        self._task_velocity = compiled(reference_task_velocity)
        self._joint_velocity = compiled(reference_joint_velocity)
        self._pseudo_inverse = compiled(pseudo_inverse_with)
        self._singular_value = compiled(singular_value_or_bound)
        self._binds = compiled(limit_test)
        self.inputs = {"estimated_state": 2 * n, "reference_motion": FRAME_MOTION_SIZE}
        # [q_d; q̇_d] in the plant's order, and the posture at the start from base to hand. Then the
        # error e before the last step.
        self.memory = Memory(
            reference=np.zeros(2 * n),
            posture=np.zeros(n),
            error=np.zeros(TASK_DIMENSION),
            started=0.0,
            limits=self._limits.memory,
        )
        limited = nested(self.memory.limits, self._limits.memory.limited)
        self.slack = nested(limited, SLACK)
        self.samplings = ((period, self.sample),)
        state = ("memory", "estimated_state")
        self.outputs = (
            Output("joint_reference", 2 * n, self.write_reference, state),
            Output("measured_motion", FRAME_MOTION_SIZE, self._write_motion, ("estimated_state",)),
            held("reference_error", self.memory.error),
            held("limited", limited),
            held("slack", self.slack),
        )

    def start(self, memory: Array, now: Now) -> None:
        """Takes the measured posture, at rest, as the reference."""
        reading = now["estimated_state"]
        check_signal(reading, now.port("estimated_state"))
        memory[self.memory.reference] = self._at_rest(reading)
        memory[self.memory.posture] = reading[self._q]
        memory[self.memory.started] = 1.0
        # The test of the limits is called once, so that no tick waits for its compilation.
        arm = self._arm(reading)
        self._within_limits(arm, arm.v, arm.Jv_V_WE @ arm.v, self.period)

    def sample(self, memory: Array, now: Now) -> None:
        """Advances the reference by one period towards the reference motion."""
        C = now["reference_motion"]
        check_frame_motion(C, now.port("reference_motion"))
        self.advance(memory, now, C)

    def advance(self, memory: Array, now: Now, C: Array) -> None:
        """Advances the reference towards a motion (19,) that has been checked.

        After lost ticks it advances in steps of at most a period, towards where C is by then.
        """
        elapsed = self.period if now.elapsed is None else now.elapsed
        steps = steps_of(elapsed, self.period)
        for k in range(steps):
            limited = self._move(memory, C, k * elapsed / steps, elapsed / steps)
        self._limits.keep(memory[self.memory.limits], limited, now.system, now.time)

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

    def _arm(self, state: Array) -> ArmState:
        return self._dynamics.evaluate(None, state[self.model.state_order])

    def _move(self, memory: Array, C: Array, since: float, step: float) -> Array:
        """Advances the reference by a step, towards C after `since` [s]; returns `Limited`."""
        reference = memory[self.memory.reference]
        arm = self._arm(reference)
        error = self._error(C, arm.Q_WE, arm.p_WE) + since * C[VELOCITY]
        V = self._task_velocity(C, error, self._gains.gain)
        v, limited = self._within_limits(arm, self._free(memory, arm, V), V, step)
        memory[self.memory.error] = error
        reference[self._q] += step * v
        reference[self._v] = v
        return limited

    def _free(self, memory: Array, arm: ArmState, V: Array) -> Array:
        """Returns q̇_d (n,) without limits."""
        J = arm.Jv_V_WE
        sigma = self._singular_value(J, self._damping[0])
        J_pinv, N = self._pseudo_inverse(J, np.eye(len(arm.q)), sigma, *self._damping)
        to_posture = self._gains.posture_gain * (memory[self.memory.posture] - arm.q)
        free: Array = self._joint_velocity(V, J_pinv, N, to_posture)
        return free

    def _within_limits(
        self, arm: ArmState, free: Array, V: Array, step: float
    ) -> tuple[Array, Array]:
        """Returns q̇_d (n,) and `Limited`: its change over a step [s] is Δt α, with α of (L.1).

        Args:
            arm: at q_d and the last q̇_d.
            free: q̇_d without limits (n,).
            V: V_c + K_x e (6,).
            step: [s].
        """
        J, alpha_0 = arm.Jv_V_WE, (free - arm.v) / step
        dynamics = J, arm.B, arm.Cv, arm.Fv, arm.g, _NO_WRENCH
        x = np.concatenate((arm.q, arm.v))
        if not self._binds(*dynamics, x, alpha_0, *self._limits.arguments):
            return free, UNLIMITED
        a = (V - J @ arm.v) / step + arm.Jdot_v
        alpha, limited = self._limits.constrained(arm, _NO_WRENCH, a, alpha_0)
        limited[SLACK] *= step / (_LEAST_PERIODS * self.period)
        return arm.v + step * alpha, limited

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
        if not self._measured(reading, motion):
            check_signal(reading, now.port("estimated_state"))
