"""The motion of a frame that brakes to rest by fifth-order polynomials: no velocity jumps."""

import numpy as np

from geoimp_drake.laws.frame_motion import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
)
from geoimp_drake.rotations import quaternion
from geoimp_drake.typing import Array

__all__ = ["braked_motion"]


def braked_motion(time: float, duration: float, start: Array) -> Array:
    """Returns the motion (19,) of a frame that brakes from its motion at time zero.

    With x = t/T its velocity is v_0 h(x) + a_0 T k(x). While h falls from 1 to 0, k starts at 0
    with slope 1, so the motion starts with the acceleration a_0. Both end at 0 with slope and
    curvature zero:

        h = 1 − 10 x³ + 15 x⁴ − 6 x⁵,   k = x − 6 x³ + 8 x⁴ − 3 x⁵.

    The frame comes to rest after a displacement of v_0 T/2 + a_0 T²/10. It turns about the axis of
    its angular velocity; an angular acceleration perpendicular to that axis ends at once. Floats
    only.

    Args:
        time: t since braking began [s].
        duration: T [s].
        start: the motion at time zero (19,), in W.
    """
    x, T = min(time / duration, 1.0), duration
    h = 1.0 + x**3 * (-10.0 + x * (15.0 - 6.0 * x))
    k = x * (1.0 + x**2 * (-6.0 + x * (8.0 - 3.0 * x)))
    h_dot = x**2 * (-30.0 + x * (60.0 - 30.0 * x)) / T
    k_dot = (1.0 + x**2 * (-18.0 + x * (32.0 - 15.0 * x))) / T
    H = x + x**4 * (-2.5 + x * (3.0 - x))
    K = x**2 * (0.5 + x**2 * (-1.5 + x * (1.6 - 0.5 * x)))
    v, a = start[LINEAR_VELOCITY], T * start[LINEAR_ACCELERATION]
    w, dw = (
        start[ANGULAR_VELOCITY],
        T * _along(start[ANGULAR_ACCELERATION], start[ANGULAR_VELOCITY]),
    )
    motion = np.empty(FRAME_MOTION_SIZE)
    motion[QUATERNION] = quaternion.product(quaternion.exp(T * (H * w + K * dw)), start[QUATERNION])
    motion[POSITION] = start[POSITION] + T * (H * v + K * a)
    motion[ANGULAR_VELOCITY], motion[LINEAR_VELOCITY] = h * w + k * dw, h * v + k * a
    motion[ANGULAR_ACCELERATION] = h_dot * w + k_dot * dw
    motion[LINEAR_ACCELERATION] = h_dot * v + k_dot * a
    return motion


def _along(vector: Array, axis: Array) -> Array:
    """Returns the part of a vector along an axis, which need not be a unit vector."""
    square = axis @ axis
    return vector * 0.0 if square == 0.0 else (vector @ axis / square) * axis
