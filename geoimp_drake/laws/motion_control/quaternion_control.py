"""Orientation control on the quaternion error; also the signature that its siblings share."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.rotations.quaternion import relative, to_rotation
from geoimp_drake.typing import Array

__all__ = ["orientation_acceleration", "orientation_error"]


@compilable
def orientation_error(Q_WD: Array, Q_WE: Array) -> Array:
    """(2.14) ᵉε_de = sin(ϑ_de/2) ᵉr_de (3,), in E, of the shorter way round."""
    return relative(Q_WE, Q_WD)[1:]


@compilable
def orientation_acceleration(
    Q_WD: Array, w_WD: Array, dw_WD: Array, Q_WE: Array, w_WE: Array, K_D: Array, K_P: Array
) -> Array:
    """(2.15) a_o = ω̇_d + K_Do Δω_de + K_Po R_e ᵉε_de.

    Asymptotic tracking is shown for scalar matrices K_Do = k_Do I, K_Po = k_Po I.

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
    error_W = to_rotation(Q_WE) @ orientation_error(Q_WD, Q_WE)
    return dw_WD + K_D @ (w_WD - w_WE) + K_P @ error_W
