"""Orientation control on the Euler angles of the orientation of D seen from E."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.rotations import euler
from geoimp_drake.rotations.quaternion import to_rotation
from geoimp_drake.rotations.so3 import cross
from geoimp_drake.typing import Array

__all__ = ["orientation_acceleration"]


@compilable
def orientation_acceleration(
    Q_WD: Array, w_WD: Array, dw_WD: Array, Q_WE: Array, w_WE: Array, K_D: Array, K_P: Array
) -> Array:
    """(2.12) a_o = ω̇_d + T_e(φ_de)(K_Do φ̇_de + K_Po φ_de) − Ṫ_e φ̇_de.

    φ_de are the angles of ᵉR_d = R_eᵀR_d and T_e = R_e T(φ_de), so Ṫ_e = S(ω_e)R_e T + R_e Ṫ. The
    error obeys φ̈ + K_Do φ̇ + K_Po φ = 0. Its pitch must not reach ±π/2; call
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
    R_WE = to_rotation(Q_WE)
    phi = euler.from_rotation(R_WE.T @ to_rotation(Q_WD))
    w_ED_E = R_WE.T @ (w_WD - w_WE)
    phi_dot = euler.T_inverse(phi) @ w_ED_E
    T = euler.T(phi)
    Te_dot_phi_dot = cross(w_WE, R_WE @ w_ED_E) + R_WE @ (euler.T_dot(phi, phi_dot) @ phi_dot)
    return dw_WD + R_WE @ (T @ (K_D @ phi_dot + K_P @ phi)) - Te_dot_phi_dot
