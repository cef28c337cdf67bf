"""Joint references by inverse kinematics at velocity level, with the reference's error fed back."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import joined, sized, stored
from geoimp_drake.laws.frame_motion import POSITION, QUATERNION, VELOCITY
from geoimp_drake.laws.motion_control.quaternion_control import orientation_error
from geoimp_drake.rotations.quaternion import to_rotation
from geoimp_drake.typing import Array

__all__ = ["pose_error", "reference_joint_velocity", "reference_task_velocity"]


@compilable
def pose_error(C: Array, Q_WE: Array, p_WE: Array) -> Array:
    """Returns e = [2 R_e ᵉε_ce; p_c − p_e] (6,), in W, of the shorter way round [rad, m].

    Args:
        C: motion of the frame to be followed (19,).
        Q_WE: orientation of E at the reference (4,).
        p_WE: its position (3,) [m].
    """
    Q = sized(Q_WE, 4)
    rotation = 2.0 * (to_rotation(Q) @ orientation_error(sized(C[QUATERNION], 4), Q))
    translation = sized(C[POSITION], 3) - sized(p_WE, 3)
    return joined(rotation, translation)


@compilable
def reference_task_velocity(C: Array, error: Array, gain: float) -> Array:
    """Returns V_c + K_x e (6,), in W, so that the reference's error decays at the rate K_x.

    Args:
        C: motion of the frame to be followed (19,).
        error: of `pose_error` (6,).
        gain: K_x [1/s].
    """
    return sized(C[VELOCITY], 6) + gain * sized(error, 6)


@compilable
def reference_joint_velocity(V: Array, J_pinv: Array, N: Array, posture_velocity: Array) -> Array:
    """(A.1) q̇_d = J†(V_c + K_x e) + (I − J†J) K_n (q_0 − q_d) (n,).

    Args:
        V: V_c + K_x e (6,).
        J_pinv: J† at q_d (n, 6).
        N: I − J†J (n, n).
        posture_velocity: K_n (q_0 − q_d) (n,).
    """
    return stored(J_pinv) @ stored(V) + stored(N) @ posture_velocity
