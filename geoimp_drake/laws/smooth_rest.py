"""Coming to rest from a motion, and moving from rest to rest; position, velocity, acceleration."""

import numpy as np

from geoimp_drake.typing import Array

__all__ = ["smooth_step", "stopped"]

_STEP = np.polynomial.Polynomial([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
_STEP_RATES = _STEP, _STEP.deriv(), _STEP.deriv(2)


def stopped(v: Array, time: float, time_constant: float) -> tuple[Array, Array, Array]:
    """Returns way, velocity and acceleration of a velocity that decays as exp(−t/T).

    Args:
        v: velocity at time zero (any shape) [m/s or rad/s].
        time: t [s].
        time_constant: T [s]; the way to rest is vT.
    """
    decay = np.exp(-time / time_constant)
    return v * (time_constant * (1.0 - decay)), v * decay, v * (-decay / time_constant)


def smooth_step(time: float, duration: float) -> tuple[float, float, float]:
    """Returns s, ṡ and s̈ of the fifth-order polynomial from 0 to 1 that rests at both ends."""
    x = min(max(time / duration, 0.0), 1.0)
    s, s_dot, s_ddot = (float(rate(x)) for rate in _STEP_RATES)
    return s, s_dot / duration, s_ddot / duration**2
