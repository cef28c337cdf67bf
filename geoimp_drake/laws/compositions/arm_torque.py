"""The inner loop of one arm in one call: from its reading, a reference motion and the wrench to τ.

The laws are those of the blocks, in the same order: kinematics and dynamics (2.1), (2.2), the
tracking acceleration (2.9), (2.15), joint accelerations (2.5) or (3.32), and torques (2.3). A call
from Python costs more than they do, so they share one. Floats only.

`*arm` are the fields of a `serial_chain.ChainArrays`, one by one: so they reach a compiled law
sooner. A reading holds [q; v] of the arm in the order of its plant, `order` says where (2n,).
"""

from collections.abc import Callable
from functools import cache

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import sized, stored
from geoimp_drake.laws.dynamics.serial_chain import (
    ChainArrays,
    chain_coriolis,
    chain_dynamics,
    chain_motion,
    chain_posture,
)
from geoimp_drake.laws.frame_motion import POSITION, QUATERNION, VELOCITY, is_finite
from geoimp_drake.laws.motion_control.inverse_dynamics import actuation
from geoimp_drake.laws.motion_control.quaternion_control import orientation_acceleration
from geoimp_drake.laws.motion_control.resolved_acceleration import resolved_acceleration
from geoimp_drake.laws.motion_control.tracking_acceleration import tracking_acceleration
from geoimp_drake.laws.redundancy.internal_motion import internal_acceleration, internal_error
from geoimp_drake.laws.redundancy.redundant_acceleration import redundant_acceleration
from geoimp_drake.rotations.quaternion import from_rotation
from geoimp_drake.typing import Array

__all__ = ["arm_quantities", "arm_torque", "measured_motion", "redundant_arm_torque"]

_tracking_acceleration = compilable(tracking_acceleration(orientation_acceleration))


def measured_motion(order: Array, reading: Array, motion: Array, *arm: Array) -> bool:
    """Writes the motion of E (19,) that a reading tells, accelerations zero; says whether it could.

    Args:
        order: of the reading (2n,).
        reading: at least (2n,) [rad, m; rad/s, m/s]; must be finite.
        motion: where to write.
        arm: its constants.
    """
    x, n = reading[order], len(order) // 2
    if not is_finite(x):
        return False
    s, _, X_WE = chain_posture(ChainArrays(*arm), x[:n])
    motion[:] = 0.0
    motion[QUATERNION] = from_rotation(X_WE[:, :3])
    motion[POSITION] = sized(X_WE[:, 3], 3)
    motion[VELOCITY] = sized(chain_motion(s, x[n:], X_WE[:, 3])[1], 6)
    return True


def arm_quantities(q: Array, v: Array, *arm: Array) -> tuple[Array, ...]:
    """Returns Q_WE, R_WE, p_WE, V_WE, J, J̇q̇, B, Cq̇, Fq̇ and g of (2.1), (2.2).

    Args:
        q: joint positions (n,) [rad, m].
        v: joint velocities (n,).
        arm: its constants.
    """
    chain = ChainArrays(*arm)
    s, links, X_WE = chain_posture(chain, q)
    R_WE, p_WE = X_WE[:, :3].copy(), X_WE[:, 3].copy()
    J, V_WE, Jdot_v = chain_motion(s, v, p_WE)
    B, _, Cv, g = chain_dynamics(chain, s, links, v)
    return from_rotation(R_WE), R_WE, p_WE, V_WE, J, Jdot_v, B, Cv, chain.friction * v, g


def arm_torque(
    order: Array,
    actuation_order: Array,
    orientation: Array,
    position: Array,
    reading: Array,
    reference: Array,
    h: Array,
    u: Array,
    *arm: Array,
) -> bool:
    """Writes the torques of a six-joint arm; says whether it could: signals must be finite.

    Args:
        order: of the reading (12,).
        actuation_order: which joint each actuator drives (6,).
        orientation: K_Do and K_Po (2, 3, 3) [1/s, 1/s²].
        position: K_Dp and K_Pp (2, 3, 3) [1/s, 1/s²].
        reading: at least (12,) [rad, m; rad/s, m/s].
        reference: motion of the frame to be tracked (19,).
        h: wrench by the end effector on the environment (6,) [Nm, N].
        u: τ (6,), where to write [Nm, N].
        arm: its constants.

    Raises:
        numpy.linalg.LinAlgError: J is exactly singular.
    """
    x, chain, a = reading[order], ChainArrays(*arm), np.empty(6)
    q, v = x[:6], x[6:]
    if not is_finite(x):
        return False
    s, links, X_WE = chain_posture(chain, q)
    Q_WE, p_WE = from_rotation(X_WE[:, :3]), X_WE[:, 3]
    columns, V_WE, bias = chain_motion(s, v, p_WE)
    if not _tracking_acceleration(reference, Q_WE, p_WE, V_WE, orientation, position, a):
        return False
    inertia, _, coriolis, weight = chain_dynamics(chain, s, links, v)
    J, B = sized(columns, 6, 6), sized(inertia, 6, 6)
    Cv, g, Fv = sized(coriolis, 6), sized(weight, 6), sized(chain.friction, 6) * sized(v, 6)
    alpha = resolved_acceleration(J, sized(bias, 6), sized(a, 6))
    return actuation(B, alpha, Cv, Fv, g, J, sized(h, 6), actuation_order, u)


@cache
def redundant_arm_torque(n: int) -> Callable[..., bool]:
    """Returns the law of an arm of n > 6 joints."""

    def law(
        order: Array,
        actuation_order: Array,
        orientation: Array,
        position: Array,
        reading: Array,
        reference: Array,
        h: Array,
        u: Array,
        gradient: Array,
        gradient_rate: Array,
        error: Array,
        K_n: Array,
        k_beta: float,
        weights: Array,
        weighs_by_inertia: bool,
        threshold: float,
        factor: float,
        *arm: Array,
    ) -> bool:
        """Writes the torques; says whether it could: signals must be finite.

        Args:
            order: of the reading (2n,).
            actuation_order: which joint each actuator drives (n,).
            orientation: K_Do and K_Po (2, 3, 3) [1/s, 1/s²].
            position: K_Dp and K_Pp (2, 3, 3) [1/s, 1/s²].
            reading: at least (2n,) [rad, m; rad/s, m/s].
            reference: motion of the frame to be tracked (19,).
            h: wrench by the end effector on the environment (6,) [Nm, N].
            u: τ (n,), where to write [Nm, N].
            gradient: of the task function (n,).
            gradient_rate: its rate along the arm's motion (n,).
            error: where to write e_n of (3.37) (n,).
            K_n: gain of e_n (n, n).
            k_beta: gain of the task function.
            weights: a constant W and its inverse (2, n, n).
            weighs_by_inertia: (3.36) W = B instead.
            threshold: σ₀ of `damped_pseudo_inverse`.
            factor: λ₀ of the same.
            arm: its constants.
        """
        x, chain, a = reading[order], ChainArrays(*arm), np.empty(6)
        if not is_finite(x):
            return False
        s, links, X_WE = chain_posture(chain, x[:n])
        Q_WE, p_WE = from_rotation(X_WE[:, :3]), X_WE[:, 3]
        columns, V_WE, bias = chain_motion(s, x[n:], p_WE)
        if not _tracking_acceleration(reference, Q_WE, p_WE, V_WE, orientation, position, a):
            return False
        inertia, inertia_rate, coriolis, weight = chain_dynamics(chain, s, links, x[n:])
        J, v, Jdot_v = sized(columns, 6, n), sized(x[n:], n), sized(bias, 6)
        B, dB = sized(inertia, n, n), sized(inertia_rate, n, n)
        Cv, g, Fv = sized(coriolis, n), sized(weight, n), sized(chain.friction, n) * v
        W, W_inverse, dW = sized(weights[0], n, n), sized(weights[1], n, n), 0.0 * B
        B_inverse, J_pinv, N, beta, e_n = internal_error(
            J,
            B,
            W_inverse,
            weighs_by_inertia,
            threshold,
            factor,
            k_beta,
            sized(gradient, n),
            v,
        )
        if weighs_by_inertia:
            W, W_inverse, dW = B, B_inverse, dB
        # C e_n as `null_space_acceleration.coriolis_product` finds it.
        c_moved = sized(chain_coriolis(s, links, stored(v + e_n)), n)
        c_e = sized(chain_coriolis(s, links, stored(e_n)), n)
        alpha_n = internal_acceleration(
            J,
            v,
            J_pinv,
            N,
            W,
            W_inverse,
            dW,
            B_inverse,
            dB,
            k_beta,
            beta,
            sized(gradient_rate, n),
            sized(K_n, n, n) @ e_n,
            0.5 * (c_moved - Cv - c_e),
        )
        alpha = redundant_acceleration(J_pinv, sized(a, 6), Jdot_v, alpha_n)
        error[:n] = e_n
        return actuation(B, alpha, Cv, Fv, g, J, sized(h, 6), actuation_order, u)

    return law
