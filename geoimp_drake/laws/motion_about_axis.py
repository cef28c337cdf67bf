"""The motion of a frame along a line while it turns about a fixed axis, from rest to rest."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import sized
from geoimp_drake.laws.frame_motion import (
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

__all__ = ["motion_from_rest"]


@compilable
def motion_from_rest(time: float, duration: float, start: Array, way: Array, motion: Array) -> None:
    """Writes the frame motion (19,) along a line and about an axis, from rest to rest.

    Displacement and angle follow the fifth-order polynomial of `smooth_step`. Floats only.

    Args:
        time: since the start [s].
        duration: until the frame rests again [s].
        start: motion of the frame that rests at the start (19,).
        way: displacement [m], angle [rad] and the unit vector of the axis, zero for no turn, in W
            (7,).
        motion: where to write.
    """
    s, s_dot, s_ddot = smooth_step(time, duration)
    rest, line = sized(start, FRAME_MOTION_SIZE), sized(way, 7)
    displacement, turn = line[:3], line[3] * line[4:]
    motion[QUATERNION] = product(exp(s * turn), rest[QUATERNION])
    motion[POSITION] = rest[POSITION] + s * displacement
    motion[ANGULAR_VELOCITY] = s_dot * turn
    motion[LINEAR_VELOCITY] = s_dot * displacement
    motion[ANGULAR_ACCELERATION] = s_ddot * turn
    motion[LINEAR_ACCELERATION] = s_ddot * displacement
