"""Trapezoidal speed profile: from rest to rest with bounded speed and acceleration."""

import math

import numpy as np
from pydrake.trajectories import PiecewisePolynomial

from geoimp_drake.errors import ConfigurationError

__all__ = ["trapezoidal_profile"]


def trapezoidal_profile(
    start_time: float, speed: float, acceleration: float
) -> PiecewisePolynomial:
    """Returns the path parameter s from 0 to 1 over time.

    It accelerates for T_a = ṡ/s̈, runs at ṡ and brakes for T_a; the whole time is T = 1/ṡ + T_a. On
    a path too short to reach ṡ (1 < ṡ T_a) the profile is a triangle of height √s̈.

    Args:
        start_time: [s].
        speed: greatest ṡ, of whole paths a second [1/s].
        acceleration: s̈ [1/s²].

    Raises:
        ConfigurationError: a part of the profile is so short that its beginning and end are equal
            in floating point.
    """
    speed = min(speed, math.sqrt(acceleration))
    ramp = speed / acceleration
    duration = 1.0 / speed + ramp
    ramped = 0.5 * speed * ramp  # part of the path covered while accelerating
    times = np.array([0.0, ramp, duration - ramp, duration])
    s, rate = np.array([0.0, ramped, 1.0 - ramped, 1.0]), np.array([0.0, speed, speed, 0.0])
    if 1.0 - 2.0 * ramped < 1e-9:
        times, s, rate = (np.delete(row, 2) for row in (times, s, rate))
    times += start_time
    if not (np.diff(times) > 0).all():
        raise ConfigurationError(
            f"a move from {start_time:.9g} s on would take {duration:.3g} s, {ramp:.3g} s of it to "
            f"gather speed, which is lost in rounding. Give a lower speed and acceleration."
        )
    # The cubics with these values and slopes at both ends of each part are its parabolas and line.
    return PiecewisePolynomial.CubicHermite(times, s[np.newaxis], rate[np.newaxis])
