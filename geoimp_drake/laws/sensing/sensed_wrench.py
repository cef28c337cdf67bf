"""The tool's load on a wrist sensor, and the wrench h of (2.2) from the sensor's reading.

Frames: S the sensor, T the tool beyond it, E the end effector, W the world.
"""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import sized
from geoimp_drake.laws.frame_motion import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    LINEAR_ACCELERATION,
    POSITION,
    is_finite,
    is_frame_motion,
)
from geoimp_drake.rotations.so3 import cross
from geoimp_drake.typing import Array

__all__ = ["inertial_acceleration", "load_of_tool", "sensed_wrench", "shifted_moment"]


@compilable
def inertial_acceleration(a_WP: Array, w_WT: Array, dw_WT: Array, p_PC: Array) -> Array:
    """Returns the acceleration a_P + ω̇ × p_PC + ω × (ω × p_PC) of point C of tool T.

    Args:
        a_WP: acceleration of a point P of the tool, in W (3) [m/s²].
        w_WT: angular velocity of the tool, in W (3) [rad/s].
        dw_WT: its angular acceleration, in W (3) [rad/s²].
        p_PC: from P to C, in W (3) [m].
    """
    return a_WP + cross(dw_WT, p_PC) + cross(w_WT, cross(w_WT, p_PC))


@compilable
def load_of_tool(
    mass: float,
    p_SC: Array,
    I_TC: Array,
    gravity: Array,
    a_WC: Array,
    w_WT: Array,
    dw_WT: Array,
) -> tuple[Array, Array]:
    """Returns what a sensor reads of the tool alone: moment about So and force on the tool, in W.

        f = m (a_C − g),   μ = p_SC × f + I ω̇ + ω × I ω

    Args:
        mass: of the tool [kg].
        p_SC: from the sensor's origin to the tool's centre of mass C, in W (3) [m].
        I_TC: rotational inertia of the tool about C, in W (3×3) [kg m²].
        gravity: g in W (3) [m/s²].
        a_WC: acceleration of C, in W (3) [m/s²]; with zero the force is that of the weight.
        w_WT: angular velocity of the tool, in W (3) [rad/s].
        dw_WT: its angular acceleration, in W (3) [rad/s²].
    """
    f = mass * (a_WC - gravity)
    return cross(p_SC, f) + I_TC @ dw_WT + cross(w_WT, I_TC @ w_WT), f


@compilable
def shifted_moment(moment: Array, force: Array, p_AB: Array) -> Array:
    """Returns the moment about B of a wrench given about A: μ_B = μ_A − p_AB × f."""
    return moment - cross(p_AB, force)


@compilable
def sensed_wrench(
    reading: Array,
    X_WT: Array,
    X_TS: Array,
    p_TE: Array,
    mass: float,
    p_SC_S: Array,
    I_TC_S: Array,
    gravity: Array,
    motion: Array,
    h: Array,
) -> bool:
    """Writes h = [moment; force] (6,) about Eo, in W: the tool's load removed, moved to E.

    Returns False if the reading or the motion is not finite. Floats only.

    Args:
        reading: [moment; force] by the arm on the sensor and its tool, about So, in S (6,).
        X_WT: pose of the tool in W, [R p] (3, 4).
        X_TS: pose of the sensor in T, [R p] (3, 4).
        p_TE: E's origin in T (3,) [m].
        mass: of the tool [kg].
        p_SC_S: the tool's centre of mass C in S (3,) [m].
        I_TC_S: its rotational inertia about C, in S (3, 3) [kg m²].
        gravity: in W (3,) [m/s²].
        motion: of a point of the tool (19,); with zero rates only the weight is removed.
        h: where to write.
    """
    if not is_finite(reading) or not is_frame_motion(motion):
        return False
    X, X_S, h_S = sized(X_WT, 3, 4), sized(X_TS, 3, 4), sized(reading, 6)
    P = sized(motion, FRAME_MOTION_SIZE)
    R_WT, R_WS = X[:, :3], X[:, :3] @ X_S[:, :3]
    p_TS_W, p_TE_W, p_SC = R_WT @ X_S[:, 3], R_WT @ sized(p_TE, 3), R_WS @ sized(p_SC_S, 3)
    w, dw, p_PC = (
        P[ANGULAR_VELOCITY],
        P[ANGULAR_ACCELERATION],
        X[:, 3] + p_TS_W + p_SC - P[POSITION],
    )
    a_WC = inertial_acceleration(P[LINEAR_ACCELERATION], w, dw, p_PC)
    I_TC = R_WS @ sized(I_TC_S, 3, 3) @ R_WS.T
    load_moment, load_force = load_of_tool(mass, p_SC, I_TC, sized(gravity, 3), a_WC, w, dw)
    force = R_WS @ h_S[3:] - load_force
    h[:3] = shifted_moment(R_WS @ h_S[:3] - load_moment, force, p_TE_W - p_TS_W)
    h[3:6] = force
    return True
