"""The order of a frame motion, and checks of frame motions and other signals.

First come the unit quaternion [w, x, y, z] and the position p of the frame. Its angular velocity ω,
linear velocity v, angular acceleration ω̇ and linear acceleration v̇ follow. All are of the frame
in W, expressed in W. A frame motion without its accelerations is the state of an integrated frame.
"""

import math

import numpy as np

from geoimp_drake.compilation.compiled import compilable, compilable_as
from geoimp_drake.rotations.quaternion import UNIT_TOLERANCE
from geoimp_drake.typing import Array

__all__ = [
    "ACCELERATION",
    "ANGULAR_ACCELERATION",
    "ANGULAR_VELOCITY",
    "FRAME_MOTION_SIZE",
    "FRAME_STATE_SIZE",
    "LINEAR_ACCELERATION",
    "LINEAR_VELOCITY",
    "POSE_SIZE",
    "POSITION",
    "QUATERNION",
    "VELOCITY",
    "is_finite",
    "is_frame_motion",
]

FRAME_MOTION_SIZE = 19
FRAME_STATE_SIZE = 13
POSE_SIZE = 7
QUATERNION = slice(0, 4)
POSITION = slice(4, 7)
ANGULAR_VELOCITY = slice(7, 10)
LINEAR_VELOCITY = slice(10, 13)
VELOCITY = slice(7, 13)
ANGULAR_ACCELERATION = slice(13, 16)
LINEAR_ACCELERATION = slice(16, 19)
ACCELERATION = slice(13, 19)


def _are_finite(value: Array) -> bool:
    squares = 0.0
    for entry in value:
        squares += entry * entry
    return math.isfinite(squares)


@compilable_as(_are_finite)
def is_finite(value: Array) -> bool:
    """Whether every entry of a vector is finite.

    The sum of squares is NaN or infinite if any entry is: one cheap call in place of many tests.
    """
    return bool(np.dot(value, value) < math.inf)


@compilable
def is_frame_motion(motion: Array) -> bool:
    """Whether a frame motion (19,) is finite and has a unit quaternion."""
    Q = motion[QUATERNION]
    norm = np.sqrt(Q[0] * Q[0] + Q[1] * Q[1] + Q[2] * Q[2] + Q[3] * Q[3])
    return is_finite(motion) and abs(norm - 1.0) <= UNIT_TOLERANCE
