"""The inner loop of one arm in one call: from its reading, a reference motion and the wrench to τ.

The laws are those of the blocks, in the same order. They are kinematics and dynamics (2.1), (2.2),
the tracking acceleration (2.9) and (2.10)-(2.15), joint accelerations (2.5) or (3.32), and torques
(2.3). A call from Python costs more than these laws, so they share one. Floats only.

A reading holds [q; v] in the order of the arm's plant. `order` (2n,) has the places in it of the
joints' [q; v] from base to hand.
"""

from collections.abc import Callable
from functools import cache

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import local, sized
from geoimp_drake.laws.compositions.chain_null_space import chain_null_space
from geoimp_drake.laws.dynamics.serial_chain import (
    ChainArrays,
    ChainValues,
    chain_dynamics,
    chain_motion,
    chain_posture,
    chain_state,
)
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.laws.limits.acceleration_box import limits_bind
from geoimp_drake.laws.motion_control.inverse_dynamics import actuation
from geoimp_drake.laws.motion_control.resolved_acceleration import resolved_acceleration
from geoimp_drake.laws.motion_control.tracking_acceleration import tracking_acceleration
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import singular_value_or_bound
from geoimp_drake.laws.redundancy.redundant_acceleration import redundant_acceleration
from geoimp_drake.rotations.quaternion import from_rotation
from geoimp_drake.typing import Array

__all__ = ["BOUND", "DONE", "UNUSABLE", "arm_torque", "redundant_arm_torque"]

_ZERO = np.zeros(6)

# What a law returns: a signal cannot be used, the torques are written, or a limit binds. If one
# binds, the torques are left to the quadratic program of `constrained_acceleration`.
UNUSABLE, DONE, BOUND = 0, 1, 2


@cache
def arm_torque(orientation_law: Callable[..., Array]) -> Callable[..., int]:
    """Returns the law of an arm of six joints.

    Args:
        orientation_law: see `orientation_control.ORIENTATION_LAWS`.
    """
    track = compilable(tracking_acceleration(orientation_law))

    def law(
        arm: ChainArrays,
        found: ChainValues,
        order: Array,
        actuation_order: Array,
        orientation: Array,
        position: Array,
        limits: Array,
        settings: Array,
        reading: Array,
        reference: Array,
        h: Array,
        u: Array,
    ) -> int:
        """Writes the torques of a six-joint arm; returns UNUSABLE, DONE or BOUND.

        Args:
            arm: its constants.
            found: memory for its quantities.
            order: of the reading (12,).
            actuation_order: which joint each actuator drives (6,).
            orientation: K_Do and K_Po (2, 3, 3) [1/s, 1/s²].
            position: K_Dp and K_Pp (2, 3, 3) [1/s, 1/s²].
            limits: see `acceleration_box` (5, 6).
            settings: see `constrained_acceleration`.
            reading: at least (12,) [rad, m; rad/s, m/s].
            reference: motion of the frame to be tracked (19,).
            h: wrench by the end effector on the environment (6,) [Nm, N].
            u: τ (6,), where to write [Nm, N].

        Raises:
            numpy.linalg.LinAlgError: J is exactly singular.
        """
        q, v = chain_state(order, reading, found)
        if not is_finite(found.x):
            return UNUSABLE
        chain_posture(arm, q, found)
        X_WE, a = found.X_WE, local(sized(_ZERO, 6))
        Q_WE, p_WE = from_rotation(X_WE[:, :3]), X_WE[:, 3]
        chain_motion(v, found)
        if not track(reference, Q_WE, p_WE, found.V_WE, orientation, position, a):
            return UNUSABLE
        chain_dynamics(arm, v, found)
        J, B = sized(found.J, 6, 6), sized(found.B, 6, 6)
        Cv, g, Fv = sized(found.Cv, 6), sized(found.g, 6), sized(arm.friction, 6) * sized(v, 6)
        if singular_value_or_bound(J, settings[2]) < settings[2]:
            return BOUND
        alpha = resolved_acceleration(J, sized(found.Jdot_v, 6), sized(a, 6))
        if not actuation(B, alpha, Cv, Fv, g, J, sized(h, 6), actuation_order, u):
            return UNUSABLE
        binds = limits_bind(found.x, found.B, local(alpha), u, actuation_order, limits, settings)
        return BOUND if binds else DONE

    return law


@cache
def redundant_arm_torque(n: int, orientation_law: Callable[..., Array]) -> Callable[..., int]:
    """Returns the law of an arm of n > 6 joints; `orientation_law` is as for `arm_torque`."""
    track, null_space = compilable(tracking_acceleration(orientation_law)), chain_null_space(n)

    def law(
        arm: ChainArrays,
        found: ChainValues,
        order: Array,
        actuation_order: Array,
        orientation: Array,
        position: Array,
        limits: Array,
        settings: Array,
        gains: tuple,
        reading: Array,
        reference: Array,
        h: Array,
        u: Array,
        gradient: Array,
        gradient_rate: Array,
        error: Array,
    ) -> int:
        """Writes the torques; returns UNUSABLE, DONE or BOUND.

        Args:
            arm: this and all arguments before `gains` are as for six joints.
            found: see there.
            order: see there (2n,).
            actuation_order: see there (n,).
            orientation: see there.
            position: see there.
            limits: see there (5, n).
            settings: see there.
            gains: of the null-space motion, see `chain_null_space`.
            reading: at least (2n,) [rad, m; rad/s, m/s].
            reference: motion of the frame to be tracked (19,).
            h: wrench by the end effector on the environment (6,) [Nm, N].
            u: τ (n,), where to write [Nm, N].
            gradient: of the task function (n,).
            gradient_rate: its rate along the arm's motion (n,).
            error: where to write e_n of (3.37), and `null_space_decay_bound` (n + 1,).
        """
        q, v = chain_state(order, reading, found)
        if not is_finite(found.x):
            return UNUSABLE
        chain_posture(arm, q, found)
        X_WE, a = found.X_WE, local(sized(_ZERO, 6))
        Q_WE, p_WE = from_rotation(X_WE[:, :3]), X_WE[:, 3]
        chain_motion(v, found)
        if not track(reference, Q_WE, p_WE, found.V_WE, orientation, position, a):
            return UNUSABLE
        chain_dynamics(arm, v, found)
        J, B, Jdot_v = sized(found.J, 6, n), sized(found.B, n, n), sized(found.Jdot_v, 6)
        Cv, g, Fv = sized(found.Cv, n), sized(found.g, n), sized(arm.friction, n) * sized(v, n)
        J_pinv, alpha_n, e_n, bound = null_space(gains, found, gradient, gradient_rate)
        alpha = redundant_acceleration(J_pinv, sized(a, 6), Jdot_v, alpha_n)
        error[:n] = e_n
        error[n] = bound
        if not actuation(B, alpha, Cv, Fv, g, J, sized(h, 6), actuation_order, u):
            return UNUSABLE
        if singular_value_or_bound(J, settings[2]) < settings[2]:
            return BOUND
        binds = limits_bind(found.x, found.B, local(alpha), u, actuation_order, limits, settings)
        return BOUND if binds else DONE

    return law
