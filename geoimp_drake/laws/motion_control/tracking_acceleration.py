"""The acceleration that makes E track a reference frame: orientation and position in one call."""

from collections.abc import Callable
from functools import cache

from geoimp_drake.compilation.small_arrays import sized
from geoimp_drake.laws.frame_motion import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
    is_frame_motion,
)
from geoimp_drake.laws.motion_control.position_control import position_acceleration
from geoimp_drake.typing import Array

__all__ = ["tracking_acceleration"]


@cache
def tracking_acceleration(orientation_law: Callable[..., Array]) -> Callable[..., bool]:
    """Returns the law of the inner motion loop for an orientation law.

    Args:
        orientation_law: see `orientation_control.ORIENTATION_LAWS`.
    """

    def law(
        reference: Array,
        Q_WE: Array,
        p_WE: Array,
        V_WE: Array,
        orientation: Array,
        position: Array,
        a: Array,
    ) -> bool:
        """Writes the task acceleration a = [a_o; a_p] of E. Floats only.

        Returns False if the reference is not finite or its quaternion not unit.

        Args:
            reference: motion of the frame to be tracked (19,).
            Q_WE: orientation of E (4,).
            p_WE: position of E (3,), in W [m].
            V_WE: velocity of E [angular; linear] (6,), in W.
            orientation: K_Do and K_Po (2, 3, 3) [1/s, 1/s²].
            position: K_Dp and K_Pp (2, 3, 3) [1/s, 1/s²].
            a: task acceleration (6,) [rad/s², m/s²], where to write.
        """
        if not is_frame_motion(reference):
            return False
        R, V = sized(reference, FRAME_MOTION_SIZE), sized(V_WE, 6)
        a[:3] = orientation_law(
            R[QUATERNION],
            R[ANGULAR_VELOCITY],
            R[ANGULAR_ACCELERATION],
            sized(Q_WE, 4),
            V[:3],
            sized(orientation[0], 3, 3),
            sized(orientation[1], 3, 3),
        )
        a[3:6] = position_acceleration(
            R[LINEAR_ACCELERATION],
            R[LINEAR_VELOCITY] - V[3:],
            R[POSITION] - sized(p_WE, 3),
            sized(position[0], 3, 3),
            sized(position[1], 3, 3),
        )
        return True

    return law
