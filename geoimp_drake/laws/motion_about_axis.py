"""The motion of a frame that moves along a curve while it turns about a fixed axis."""

import numpy as np

from geoimp_drake.compiled import compilable
from geoimp_drake.laws.motion_vector import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
)
from geoimp_drake.rotations.quaternion import exp, product
from geoimp_drake.typing import Array

__all__ = ["motion_about_axis"]


@compilable
def motion_about_axis(curve: Array, axis: Array, Q_start: Array) -> Array:
    """Returns the frame motion (19,).

    Args:
        curve: [p; angle], then its first and its second derivative (12,), in W [m, rad, s].
        axis: unit vector in W (3,), zero for no turn.
        Q_start: orientation at angle zero (4,).
    """
    motion = np.empty(FRAME_MOTION_SIZE)
    motion[QUATERNION] = product(exp(curve[3] * axis), Q_start)
    motion[POSITION] = curve[:3]
    motion[ANGULAR_VELOCITY] = curve[7] * axis
    motion[LINEAR_VELOCITY] = curve[4:7]
    motion[ANGULAR_ACCELERATION] = curve[11] * axis
    motion[LINEAR_ACCELERATION] = curve[8:11]
    return motion
