"""Torques against errors of an arm's model, added to those of its inner loop."""

import numpy as np

from geoimp_drake.arm.control_model import TASK_DIMENSION, ControlModel
from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.arm.state import ArmState
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE, VELOCITY
from geoimp_drake.laws.motion_control.closed_loop_inverse_kinematics import pose_error
from geoimp_drake.laws.motion_control.friction_compensation import (
    followed_velocity,
    friction_torque,
)
from geoimp_drake.laws.motion_control.integral_action import integral_torque, integrated_error
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import (
    SingularityDamping,
    pseudo_inverse_with,
    singular_value_or_bound,
)
from geoimp_drake.parts.momentum_observer import MomentumObserver, MomentumObserverConfig
from geoimp_drake.parts.motion_control import MotionControl
from geoimp_drake.parts.part import Memory, Now, Output, held
from geoimp_drake.parts.remedies_config import FrictionConfig, RemediesConfig
from geoimp_drake.parts.signals import check_frame_motion, check_signal
from geoimp_drake.parts.torque import Saturation
from geoimp_drake.parts.within import Within
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, finite_array

__all__ = ["Remedies"]


class Remedies:
    """The part of `systems.arm.remedies.Remedies`.

    As a step begins, it computes the torques to add from the next sample of the readings on. So
    every form and plant has the same torques, and the observer knows those that have acted.

    Args:
        model: the arm.
        config: which remedies, and how.
        motion: the inner loop's gains; the integral's are in proportion to them.
        period: of the readings [s].
        damping: near singularities.

    Raises:
        ConfigurationError: a field of the configuration cannot be used.
    """

    def __init__(
        self,
        model: ControlModel,
        config: RemediesConfig,
        motion: MotionControl,
        period: float,
        damping: SingularityDamping | None = None,
    ):
        check(config, "remedies")
        config.warn_of_contact()
        damping = damping or SingularityDamping()
        n = model.num_joints
        self.config, self._model, self._dynamics = config, model, ChainDynamics(model)
        self._saturation, self._identity = Saturation(model), np.eye(n)
        self._damping = damping.threshold, damping.factor
        self._K_P = motion.stiffness  # `pose_error` has angles
        self._coulomb, self._viscous = _friction_of(config.friction, n)
        self._observer = None
        if config.disturbance_observer is not None:
            gain = config.disturbance_observer.gain
            self._observer = MomentumObserver(model, MomentumObserverConfig(gain=gain))
        self._singular_value = compiled(singular_value_or_bound)
        self._pseudo_inverse = compiled(pseudo_inverse_with)
        self._error, self._integrated = compiled(pose_error), compiled(integrated_error)
        self._integral, self._friction = compiled(integral_torque), compiled(friction_torque)
        self._followed = compiled(followed_velocity)
        self.inputs = {
            "torque": n,
            "estimated_state": 2 * n,
            "reference_motion": FRAME_MOTION_SIZE,
            "wrench": TASK_DIMENSION,
        }
        self.memory = Memory(
            time=np.nan,  # when the last step began
            # The torques added, and those without feedforward; now, and from the next sample on.
            compensation=np.zeros(n),
            observed=np.zeros(n),
            next_compensation=np.zeros(n),
            next_observed=np.zeros(n),
            torque=np.zeros(n),  # over the step, as the observer is to know it
            error_sum=np.zeros(TASK_DIMENSION),
            observer=Memory() if self._observer is None else self._observer.memory,
            peak=self._saturation.memory,
        )
        self.samplings = ((period, self.sample),)
        self.outputs = (
            Output("actuation", n, self._write_actuation, ("memory", "torque")),
            held("compensation", self.memory.compensation),
            held("peak_effort", self.memory.peak),
        )

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Finds what to add after this step; compares the torques of this step with the limits.

        Raises:
            SignalError: an input is NaN or infinite, or the reference's quaternion is not unit.
        """
        for name in self.inputs:
            check_signal(now[name], now.port(name))
        check_frame_motion(now["reference_motion"], now.port("reference_motion"))
        places, h = self.memory, now["wrench"]
        arm = self._dynamics.evaluate(None, now["estimated_state"][self._model.state_order])
        observed = self._against_disturbance(memory, now)
        compensation = observed
        if self.config.integral is not None or self.config.friction is not None:
            J = arm.Jv_V_WE
            sigma = self._singular_value(J, self._damping[0])
            J_pinv, _ = self._pseudo_inverse(J, self._identity, sigma, *self._damping)
            observed = observed + self._in_order(self._by_integral(memory, now, arm, J_pinv))
            # The observer does not know of the friction that is fed forward.
            compensation = observed + self._in_order(self._forward(now, arm, J_pinv))
        felt = self._in_order(arm.Jv_V_WE.T @ h)
        memory[places.torque] = now["torque"] + memory[places.observed] - felt
        memory[places.next_compensation], memory[places.next_observed] = compensation, observed
        memory[places.time] = now.time
        self._compare(memory, now)

    def sample(self, memory: Array, now: Now) -> None:
        """Adds from now on the torques that have been found."""
        places = self.memory
        memory[places.compensation] = memory[places.next_compensation]
        memory[places.observed] = memory[places.next_observed]

    def actuation(self, memory: Array, torque: Array) -> Array:
        """Returns the torques of the inner loop and what is added, in the actuators' order (n,)."""
        total: Array = torque + memory[self.memory.compensation]
        return total

    def _compare(self, memory: Array, now: Now) -> None:
        total = self.actuation(memory, now["torque"])
        saturated = self._saturation.compare(memory[self.memory.peak], total)
        if saturated:
            self._saturation.report(saturated, total, now.system, now.time)

    def _against_disturbance(self, memory: Array, now: Now) -> Array:
        """Returns −r of (R.3) in the actuators' order (n,), zero without an observer."""
        if self._observer is None or self.config.disturbance_observer is None:
            return np.zeros(self._model.num_joints)
        place = memory[self.memory.observer]
        view = Within(now, {}, {"torque": memory[self.memory.torque]})
        waits = self._touches(now["wrench"]) and not self.config.disturbance_observer.in_contact
        self._observer.observe(place, view, is_held=waits)
        return self._in_order(-place[self._observer.memory.residual])

    def _by_integral(self, memory: Array, now: Now, arm: ArmState, J_pinv: Array) -> Array:
        """Returns the torques of (R.1) from base to hand (n,)."""
        integral = self.config.integral
        if integral is None:
            return np.zeros(self._model.num_joints)
        error_sum, elapsed = memory[self.memory.error_sum], now.time - memory[self.memory.time]
        if elapsed > 0.0 and not self._is_held(memory, now):
            error = self._error(now["reference_motion"], arm.Q_WE, arm.p_WE)
            error_sum[:] = self._integrated(
                error_sum, error, elapsed, integral.largest / integral.rate
            )
        torque: Array = self._integral(arm.B, J_pinv, integral.rate * self._K_P, error_sum)
        return torque

    def _is_held(self, memory: Array, now: Now) -> bool:
        """Whether the integral is held: in contact, or with a torque at its limit."""
        if self.config.integral is not None and self.config.integral.in_contact:
            touches = False
        else:
            touches = self._touches(now["wrench"])
        asked = np.abs(self.actuation(memory, now["torque"]))
        return touches or bool((asked >= self._saturation.limits).any())

    def _forward(self, now: Now, arm: ArmState, J_pinv: Array) -> Array:
        """Returns the torques of (R.2) from base to hand (n,)."""
        if self.config.friction is None:
            return np.zeros(self._model.num_joints)
        v = self._followed(J_pinv, arm.v, arm.V_WE, now["reference_motion"][VELOCITY])
        torque: Array = self._friction(v, self._coulomb, self._viscous, self.config.friction.slow)
        return torque

    def _touches(self, h: Array) -> bool:
        force, moment = h[3:] @ h[3:], h[:3] @ h[:3]
        least = self.config.touch_force, self.config.touch_moment
        return bool(force >= least[0] ** 2 or moment >= least[1] ** 2)

    def _in_order(self, torque: Array) -> Array:
        """Returns torques from base to hand in the order of the actuators (n,)."""
        return torque[self._model.actuation_order]

    def _write_actuation(self, now: Now, total: Array) -> None:
        total[:] = self.actuation(now.memory, now["torque"])


def _friction_of(config: FrictionConfig | None, n: int) -> tuple[Array, Array]:
    """Returns F_c and F_v of (R.2) (n,), times `share`."""
    if config is None:
        return np.zeros(n), np.zeros(n)
    coulomb, viscous = (
        finite_array(
            np.full(n, value) if np.ndim(value) == 0 else value, f"remedies.friction.{name}", (n,)
        )
        for name, value in (("coulomb", config.coulomb), ("viscous", config.viscous))
    )
    return config.share * coulomb, config.share * viscous
