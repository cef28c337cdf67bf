"""The references (4.10)-(4.15) of both hands in one call, as frame motions (19,); floats only.

C is the motion of the compliant object. The order of a frame motion is that of `laws.frame_motion`.
"""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import sized
from geoimp_drake.laws.cooperation.moving_mutual_pose import (
    mutual_position_motion,
    reference_rotations,
)
from geoimp_drake.laws.cooperation.reference_pose import (
    reference_orientation_1,
    reference_orientation_2,
    reference_position_1,
    reference_position_2,
)
from geoimp_drake.laws.cooperation.reference_velocity import (
    reference_velocity_1,
    reference_velocity_2,
    rigid_mutual_acceleration,
    rigid_mutual_velocity,
)
from geoimp_drake.laws.frame_motion import (
    ACCELERATION,
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSE_SIZE,
    POSITION,
    QUATERNION,
    VELOCITY,
)
from geoimp_drake.rotations.quaternion import normalized, to_rotation
from geoimp_drake.typing import Array

__all__ = ["moving_references", "rigid_references"]


@compilable
def rigid_references(C: Array, pose: Array, hands: Array) -> None:
    """Writes the motions of both hands (2, 19) for a mutual pose that is constant in C.

    Args:
        C: motion of the object (19,), in W.
        pose: ¹Q_r21 and ᶜΔp_r21 [m] (7,).
        hands: where to write.
    """
    C, pose = sized(C, FRAME_MOTION_SIZE), sized(pose, POSE_SIZE)
    Q_WC, w, dw = C[QUATERNION], C[ANGULAR_VELOCITY], C[ANGULAR_ACCELERATION]
    Q_12, p_12_W = pose[QUATERNION], to_rotation(Q_WC) @ pose[POSITION]
    V_21 = rigid_mutual_velocity(w, p_12_W)
    A_21 = rigid_mutual_acceleration(w, dw, p_12_W)
    Q_W1 = reference_orientation_1(Q_WC, Q_12)
    hands[0, QUATERNION] = normalized(Q_W1)
    hands[1, QUATERNION] = normalized(reference_orientation_2(Q_W1, Q_12))
    hands[0, POSITION] = reference_position_1(C[POSITION], p_12_W)
    hands[1, POSITION] = reference_position_2(C[POSITION], p_12_W)
    hands[0, VELOCITY] = reference_velocity_1(C[VELOCITY], V_21)
    hands[1, VELOCITY] = reference_velocity_2(C[VELOCITY], V_21)
    hands[0, ACCELERATION] = reference_velocity_1(C[ACCELERATION], A_21)
    hands[1, ACCELERATION] = reference_velocity_2(C[ACCELERATION], A_21)


@compilable
def moving_references(C: Array, mutual: Array, hands: Array) -> None:
    """Writes the motions of both hands (2, 19) for a mutual pose that moves.

    Args:
        C: motion of the object (19,), in W.
        mutual: ¹Q_r21, ᶜΔp_r21 and the velocities and accelerations of both (19,), as
            `moving_mutual_pose` has them.
        hands: where to write.
    """
    C, mutual = sized(C, FRAME_MOTION_SIZE), sized(mutual, FRAME_MOTION_SIZE)
    Q_WC, w, dw = C[QUATERNION], C[ANGULAR_VELOCITY], C[ANGULAR_ACCELERATION]
    first, second = reference_rotations(
        Q_WC,
        w,
        dw,
        mutual[QUATERNION],
        mutual[ANGULAR_VELOCITY],
        mutual[ANGULAR_ACCELERATION],
    )
    p, v, a = mutual_position_motion(
        to_rotation(Q_WC),
        w,
        dw,
        mutual[POSITION],
        mutual[LINEAR_VELOCITY],
        mutual[LINEAR_ACCELERATION],
    )
    hands[0, QUATERNION], hands[1, QUATERNION] = normalized(first[0]), normalized(second[0])
    hands[0, ANGULAR_VELOCITY], hands[1, ANGULAR_VELOCITY] = first[1], second[1]
    hands[0, ANGULAR_ACCELERATION], hands[1, ANGULAR_ACCELERATION] = first[2], second[2]
    hands[0, POSITION] = reference_position_1(C[POSITION], p)
    hands[1, POSITION] = reference_position_2(C[POSITION], p)
    hands[0, LINEAR_VELOCITY] = reference_velocity_1(C[LINEAR_VELOCITY], v)
    hands[1, LINEAR_VELOCITY] = reference_velocity_2(C[LINEAR_VELOCITY], v)
    hands[0, LINEAR_ACCELERATION] = reference_velocity_1(C[LINEAR_ACCELERATION], a)
    hands[1, LINEAR_ACCELERATION] = reference_velocity_2(C[LINEAR_ACCELERATION], a)
