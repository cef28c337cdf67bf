"""Orientation control on the difference of the Euler angles of D and E."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.rotations import euler
from geoimp_drake.rotations.quaternion import to_rotation
from geoimp_drake.typing import Array

__all__ = ["orientation_acceleration"]


@compilable
def orientation_acceleration(
    Q_WD: Array, w_WD: Array, dw_WD: Array, Q_WE: Array, w_WE: Array, K_D: Array, K_P: Array
) -> Array:
    """(2.10) a_o = T(φ_e)(φ̈_d + K_Do Δφ̇_de + K_Po Δφ_de) + Ṫ(φ_e, φ̇_e)φ̇_e, with (2.11).

    The error obeys Δφ̈ + K_Do Δφ̇ + K_Po Δφ = 0. Neither D nor E may be at pitch ±π/2; call
    `euler.check_regular`.

    Args:
        Q_WD: orientation of D (4,).
        w_WD: its angular velocity (3,), in W [rad/s].
        dw_WD: its angular acceleration (3,), in W [rad/s²].
        Q_WE: orientation of E (4,).
        w_WE: its angular velocity (3,), in W [rad/s].
        K_D: gain (3, 3) [1/s].
        K_P: gain (3, 3) [1/s²].

    Returns:
        a_o (3,), in W [rad/s²].
    """
    phi_d = euler.from_rotation(to_rotation(Q_WD))
    phi_e = euler.from_rotation(to_rotation(Q_WE))
    phi_dot_d, ddphi_d = euler.rates(phi_d, w_WD, dw_WD)
    phi_dot_e = euler.T_inverse(phi_e) @ w_WE
    errors = K_D @ (phi_dot_d - phi_dot_e) + K_P @ euler.wrapped(phi_d - phi_e)
    return euler.T(phi_e) @ (ddphi_d + errors) + euler.T_dot(phi_e, phi_dot_e) @ phi_dot_e
