"""Orientation control on an angle/axis error of Table 2.1."""

from geoimp_drake.rotations.angle_axis import Representation, displacement
from geoimp_drake.rotations.quaternion import relative, to_rotation
from geoimp_drake.typing import Array

__all__ = ["orientation_acceleration", "orientation_error"]


def orientation_error(row: Representation, Q_WD: Array, Q_WE: Array) -> Array:
    """(2.13) ᵉo_de = f(ϑ_de) ᵉr_de (3,), in E."""
    return displacement(row, relative(Q_WE, Q_WD))


def orientation_acceleration(
    row: Representation,
    Q_WD: Array,
    w_WD: Array,
    dw_WD: Array,
    Q_WE: Array,
    w_WE: Array,
    K_D: Array,
    K_P: Array,
) -> Array:
    """(2.13) a_o = ω̇_d + K_Do Δω_de + K_Po R_e ᵉo_de, formed as (2.15) is for the quaternion.

    The chapter gives the error alone. Because f′(0) is 1 for sin ϑ and ϑ and ½ for the others, the
    same K_Po is twice as stiff for the first two.

    Args:
        row: the function f of Table 2.1.
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
    error_W = to_rotation(Q_WE) @ orientation_error(row, Q_WD, Q_WE)
    return dw_WD + K_D @ (w_WD - w_WE) + K_P @ error_W
