"""Motion and wrench of an object that two hands hold, (4.1)-(4.9), in two calls; floats only."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import joined, sized
from geoimp_drake.laws.cooperation.absolute_pose import absolute_orientation, absolute_position
from geoimp_drake.laws.cooperation.absolute_velocity import absolute_velocity
from geoimp_drake.laws.cooperation.internal_wrench import internal_wrench
from geoimp_drake.laws.cooperation.mutual_pose import mutual_orientation, mutual_position
from geoimp_drake.laws.cooperation.mutual_velocity import (
    mutual_angular_velocity,
    mutual_linear_velocity,
    mutual_velocity,
)
from geoimp_drake.laws.cooperation.object_wrench import object_wrench, printed_object_wrench
from geoimp_drake.laws.frame_motion import (
    ACCELERATION,
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
    VELOCITY,
)
from geoimp_drake.laws.sensing.sensed_wrench import inertial_acceleration, load_of_tool
from geoimp_drake.rotations.quaternion import normalized, to_rotation
from geoimp_drake.typing import Array

__all__ = ["held_object_motion", "held_object_wrenches"]


@compilable
def held_object_motion(first: Array, second: Array, nearby: Array, motions: Array) -> None:
    """Writes the motion of the object O in W and the mutual motion (2, 19).

    The accelerations of O are the means of the hands'. The mutual motion is ¹Q_21, ᵒΔp_21, ¹ω_21
    and d(ᵒΔp_21)/dt, with zeros for the accelerations.

    Args:
        first: motion of the first hand (19,), in W.
        second: the same of the second (19,).
        nearby: quaternion (4,); the one of ±¹Q_21 that is nearer to it is used.
        motions: where to write.
    """
    first, second = sized(first, FRAME_MOTION_SIZE), sized(second, FRAME_MOTION_SIZE)
    Q_12 = mutual_orientation(first[QUATERNION], second[QUATERNION], sized(nearby, 4))
    Q_WO = absolute_orientation(first[QUATERNION], Q_12)
    R_WO = to_rotation(Q_WO)
    p_12_W = mutual_position(first[POSITION], second[POSITION])
    V_WO = absolute_velocity(first[VELOCITY], second[VELOCITY])
    V_21 = mutual_velocity(first[VELOCITY], second[VELOCITY])
    motions[0, QUATERNION] = normalized(Q_WO)
    motions[0, POSITION] = absolute_position(first[POSITION], second[POSITION])
    motions[0, VELOCITY] = V_WO
    motions[0, ACCELERATION] = absolute_velocity(first[ACCELERATION], second[ACCELERATION])
    motions[1, QUATERNION] = normalized(Q_12)
    motions[1, POSITION] = R_WO.T @ p_12_W
    motions[1, ANGULAR_VELOCITY] = mutual_angular_velocity(to_rotation(first[QUATERNION]), V_21[:3])
    motions[1, LINEAR_VELOCITY] = mutual_linear_velocity(R_WO, V_WO[:3], p_12_W, V_21[3:])
    motions[1, ACCELERATION] = 0.0


@compilable
def held_object_wrenches(
    h_1: Array,
    h_2: Array,
    Q_W1: Array,
    motions: Array,
    printed: bool,
    mass: float,
    p_OG_O: Array,
    I_G_O: Array,
    gravity: Array,
    reference: Array,
    wrenches: Array,
) -> None:
    """Writes the object's wrench, the internal wrench, and the latter in mutual axes (3, 6).

    The rows are h_o without the object's load, about Oo, in W; ½(h_2 − h_1) in W; and the internal
    wrench as [¹μ; ᵒf].

    Args:
        h_1: wrench of the first hand (6,), about its own origin, in W.
        h_2: the same of the second (6,).
        Q_W1: orientation of the first hand (4,).
        motions: of `held_object_motion` (2, 19).
        printed: whether (4.6) is taken as printed, without lever arms.
        mass: of the object [kg].
        p_OG_O: its centre of mass G (3,), in O [m].
        I_G_O: its rotational inertia about G (3, 3), in O [kg m²].
        gravity: g (3,), in W [m/s²].
        reference: motion with which the object's inertial load is computed (19,); with zeros only
            the weight is removed.
        wrenches: where to write.
    """
    h_1, h_2, R = sized(h_1, 6), sized(h_2, 6), sized(reference, FRAME_MOTION_SIZE)
    O, mutual = sized(motions[0], FRAME_MOTION_SIZE), sized(motions[1], FRAME_MOTION_SIZE)  # noqa: E741
    R_WO = to_rotation(O[QUATERNION])
    r = 0.5 * (R_WO @ mutual[POSITION])  # O is halfway between the hands (4.1)
    carried = printed_object_wrench(h_1, h_2) if printed else object_wrench(h_1, h_2, -r, r)
    w, dw, p_OG = R[ANGULAR_VELOCITY], R[ANGULAR_ACCELERATION], R_WO @ sized(p_OG_O, 3)
    a_WG = inertial_acceleration(R[LINEAR_ACCELERATION], w, dw, p_OG)
    I_G = R_WO @ sized(I_G_O, 3, 3) @ R_WO.T
    moment, force = load_of_tool(mass, p_OG, I_G, sized(gravity, 3), a_WG, w, dw)
    internal = internal_wrench(h_1, h_2)
    wrenches[0, :6] = carried - joined(moment, force)
    wrenches[1, :6] = internal
    wrenches[2, :3] = to_rotation(sized(Q_W1, 4)).T @ internal[:3]
    wrenches[2, 3:6] = R_WO.T @ internal[3:]
