"""The motion of a frame that moves along a curve while it turns about a fixed axis.

Along a straight line from rest to rest it is the desired motion's segment.
"""

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
from geoimp_drake.laws.smooth_rest import smooth_step
from geoimp_drake.rotations.quaternion import exp, product
from geoimp_drake.typing import Array

__all__ = ["motion_about_axis", "motion_from_rest"]


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


@compilable
def motion_from_rest(time: float, duration: float, start: Array, way: Array, motion: Array) -> None:
    """Writes the frame motion (19,) along a line and about an axis, from rest to rest.

    Displacement and angle follow the fifth-order polynomial of `smooth_step`. Floats only.

    Args:
        time: since the start [s].
        duration: until the frame rests again [s].
        start: motion of the frame that rests at the start (19,).
        way: displacement, angle and the unit vector of the axis, zero for no turn, in W (7,).
        motion: where to write.
    """
    s, s_dot, s_ddot = smooth_step(time, duration)
    curve = np.empty(12)
    curve[:4] = s * way[:4]
    curve[:3] += start[POSITION]
    curve[4:8] = s_dot * way[:4]
    curve[8:] = s_ddot * way[:4]
    motion[:] = motion_about_axis(curve, way[4:], start[QUATERNION])
