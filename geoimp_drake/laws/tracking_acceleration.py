"""The acceleration that makes E track a reference frame: orientation and position in one call."""

from collections.abc import Callable
from functools import cache

from geoimp_drake.laws.motion_vector import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
    is_frame_motion,
)
from geoimp_drake.laws.position_control import position_acceleration
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
        """Writes the task acceleration a = [a_o; a_p] of E; says whether it could. Floats only.

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
        a[:3] = orientation_law(
            reference[QUATERNION],
            reference[ANGULAR_VELOCITY],
            reference[ANGULAR_ACCELERATION],
            Q_WE,
            V_WE[:3],
            orientation[0],
            orientation[1],
        )
        a[3:] = position_acceleration(
            reference[LINEAR_ACCELERATION],
            reference[LINEAR_VELOCITY] - V_WE[3:],
            reference[POSITION] - p_WE,
            position[0],
            position[1],
        )
        return True

    return law
