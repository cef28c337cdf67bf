"""Coming to rest from a motion, and moving from rest to rest; position, velocity, acceleration."""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.typing import Array

__all__ = ["smooth_step", "stopped"]


def stopped(v: Array, time: float, time_constant: float) -> tuple[Array, Array, Array]:
    """Returns displacement, velocity and acceleration of a velocity that decays as exp(−t/T).

    Args:
        v: velocity at time zero (any shape) [m/s or rad/s].
        time: t [s].
        time_constant: T [s]; the distance to rest is vT.
    """
    decay = np.exp(-time / time_constant)
    return v * (time_constant * (1.0 - decay)), v * decay, v * (-decay / time_constant)


@compilable
def smooth_step(time: float, duration: float) -> tuple[float, float, float]:
    """Returns s, ṡ and s̈ of the fifth-order polynomial from 0 to 1 that rests at both ends.

        s = 10 x³ − 15 x⁴ + 6 x⁵,   x = t/T

    Args:
        time: t [s]; s rests before 0 and after T.
        duration: T [s].
    """
    x = min(max(time / duration, 0.0), 1.0)
    s = x * x * x * (10.0 + x * (-15.0 + x * 6.0))
    s_dot = x * x * (30.0 + x * (-60.0 + x * 30.0))
    s_ddot = x * (60.0 + x * (-180.0 + x * 120.0))
    return s, s_dot / duration, s_ddot / (duration * duration)
