"""What a wrist sensor carries and how its reading becomes the wrench h of (2.2).

Frames: S the sensor, T the tool beyond it, E the end effector, W the world.
"""

from geoimp_drake.rotations.so3 import cross
from geoimp_drake.typing import Array

__all__ = ["inertial_acceleration", "load_of_tool", "shifted_moment"]


def inertial_acceleration(a_WP: Array, w_WT: Array, dw_WT: Array, p_PC: Array) -> Array:
    """Returns the acceleration a_P + ω̇ × p_PC + ω × (ω × p_PC) of point C of tool T.

    Args:
        a_WP: acceleration of a point P of the tool, in W (3) [m/s²].
        w_WT: angular velocity of the tool, in W (3) [rad/s].
        dw_WT: its angular acceleration, in W (3) [rad/s²].
        p_PC: from P to C, in W (3) [m].
    """
    return a_WP + cross(dw_WT, p_PC) + cross(w_WT, cross(w_WT, p_PC))


def load_of_tool(
    mass: float,
    p_SC: Array,
    I_TC: Array,
    gravity: Array,
    a_WC: Array,
    w_WT: Array,
    dw_WT: Array,
) -> tuple[Array, Array]:
    """Returns moment about S and force with which the tool alone loads the sensor, in W.

        f = m (a_C − g),   μ = p_SC × f + I ω̇ + ω × I ω

    Args:
        mass: of the tool [kg].
        p_SC: from the sensor's origin to the tool's centre of mass C, in W (3) [m].
        I_TC: rotational inertia of the tool about C, in W (3×3) [kg m²].
        gravity: g in W (3) [m/s²].
        a_WC: acceleration of C, in W (3); zero leaves the weight alone.
        w_WT: angular velocity of the tool, in W (3) [rad/s].
        dw_WT: its angular acceleration, in W (3) [rad/s²].
    """
    f = mass * (a_WC - gravity)
    return cross(p_SC, f) + I_TC @ dw_WT + cross(w_WT, I_TC @ w_WT), f


def shifted_moment(moment: Array, force: Array, p_AB: Array) -> Array:
    """Returns the moment about B of a wrench given about A: μ_B = μ_A − p_AB × f."""
    return moment - cross(p_AB, force)
