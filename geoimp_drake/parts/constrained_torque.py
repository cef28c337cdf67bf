"""The torques of one arm at its limits: what its inner loop does when a limit binds."""

import numpy as np

from geoimp_drake.arm.control_model import TASK_DIMENSION, ControlModel
from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.motion_control.inverse_dynamics import actuation
from geoimp_drake.laws.redundancy.redundant_acceleration import redundant_acceleration
from geoimp_drake.parts.joint_limits import JointLimits
from geoimp_drake.parts.law_signals import ArmSignals
from geoimp_drake.parts.motion_control import MotionControl
from geoimp_drake.parts.null_space import NullSpace
from geoimp_drake.typing import Array

__all__ = ["ConstrainedTorque"]


class ConstrainedTorque:
    """Calls the inner loop's laws one by one, with (L.1) between joint accelerations and torques.

    The compiled law of an inner loop stops when a limit binds, since the quadratic program of (L.1)
    is not compiled. This class then takes over; it is a piece of `InnerLoop`.

    Args:
        model: the arm.
        dynamics: of the arm.
        motion: gains and law of the motion loop.
        null_space: of an arm of more than six joints.
        limits: of the arm.
    """

    def __init__(
        self,
        model: ControlModel,
        dynamics: ChainDynamics,
        motion: MotionControl,
        null_space: NullSpace,
        limits: JointLimits,
    ):
        n = model.num_joints
        self._model, self._dynamics, self._motion = model, dynamics, motion
        self._gains = null_space.arguments if n > TASK_DIMENSION else None
        self._limits, self._none = limits, np.zeros(n)
        self._actuation = compiled(actuation)

    def write(self, signals: ArmSignals) -> Array:
        """Writes torques within the limits; returns `Limited` (10,).

        With more than six joints it also writes e_n and `null_space_decay_bound`.
        """
        reference, h, u, terms = signals.reference, signals.wrench, signals.u, signals.terms
        arm = self._dynamics.evaluate(None, signals.reading[self._model.state_order])
        a = self._motion.acceleration(reference, arm)
        alpha_0 = self._none
        if self._gains is not None:
            J_pinv, alpha_n, terms[2][:-1], terms[2][-1] = self._dynamics.null_space(
                None, arm, (terms[0], terms[1]), self._gains
            )
            alpha_0 = redundant_acceleration(J_pinv, a, arm.Jdot_v, alpha_n)
        alpha, limited = self._limits.constrained(arm, h, a, alpha_0)
        order = self._model.actuation_order
        self._actuation(arm.B, alpha, arm.Cv, arm.Fv, arm.g, arm.Jv_V_WE, h, order, u)
        return limited
