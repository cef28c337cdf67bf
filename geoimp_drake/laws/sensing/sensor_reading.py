"""A wrist sensor's reading of a reaction wrench: quantisation, saturation and low-pass filter.

A reading is [moment; force] (6,) in the sensor's axes. Floats only.
"""

import math

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.typing import Array

__all__ = ["filter_gain", "peak_reading", "sensor_reading"]


def filter_gain(cutoff: float, period: float) -> float:
    """The gain of a sampled first-order low-pass; 1, no filter, if `cutoff` is zero.

    Args:
        cutoff: [Hz].
        period: between samples [s].
    """
    return -math.expm1(-2.0 * math.pi * cutoff * period) if cutoff > 0 else 1.0


@compilable
def sensor_reading(
    raw: Array, before: Array, resolution: Array, limits: Array, gain: float, reading: Array
) -> bool:
    """Writes the reading: quantised, clipped to the range, then filtered.

    Returns False if the reaction is not finite.

    Args:
        raw: reaction with bias and noise (6,).
        before: the reading before this one (6,).
        resolution: quantisation steps (6,), zero for none.
        limits: half-width of the range, ±limits (6,).
        gain: of the filter; 1 takes the sample as it is.
        reading: where to write (6,).
    """
    if not is_finite(raw):
        return False
    for k in range(6):
        value, step = raw[k], resolution[k]
        if step > 0.0:
            value = np.rint(value / step) * step
        value = min(max(value, -limits[k]), limits[k])
        reading[k] = value if gain == 1.0 else before[k] + gain * (value - before[k])
    return True


@compilable
def peak_reading(raw: Array, before: Array, limits: Array, peak: Array) -> bool:
    """Writes the largest |raw|/range so far (6,); returns whether an axis just left its range."""
    passed = False
    for k in range(6):
        largest = max(before[k], abs(raw[k]) / limits[k])
        passed = passed or (before[k] <= 1.0 and largest > 1.0)
        peak[k] = largest
    return passed
