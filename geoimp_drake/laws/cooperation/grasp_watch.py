"""Detects from a hand's wrench that its grasp has opened; floats only."""

import math

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.typing import Array

__all__ = ["watch_grasps", "wrench_size"]


@compilable
def wrench_size(h: Array, force_threshold: float, moment_threshold: float) -> float:
    """Returns s = max(‖f‖/f_t, ‖μ‖/μ_t) of a wrench h = [μ; f] (6,); below 1 the hand is empty.

    Args:
        h: wrench (6,) [Nm, N].
        force_threshold: f_t [N].
        moment_threshold: μ_t [Nm].
    """
    moment, force = h[:3], h[3:]
    return max(
        math.sqrt(np.dot(force, force)) / force_threshold,
        math.sqrt(np.dot(moment, moment)) / moment_threshold,
    )


@compilable
def watch_grasps(
    h_1: Array,
    h_2: Array,
    before: Array,
    thresholds: Array,
    limits: Array,
    period: float,
    times: Array,
    opened: Array,
) -> bool:
    """Writes how long each hand has been empty and whether its grasp has opened.

    A grasp has opened if its `wrench_size` fell from `loaded` to below 1 within the fall time. It
    must since have stayed below 1 for the dwell. Returns False, without writing, if a wrench is not
    finite.

    Args:
        h_1: wrench of the first hand (6,) [Nm, N].
        h_2: the same of the second (6,).
        before: `times` one sample ago (4,).
        thresholds: f_t [N], μ_t [Nm] and `loaded`, a multiple of them (3,).
        limits: fall time and dwell (2,) [s].
        period: between samples [s].
        times: since each hand was loaded, and since it was last not empty (4,) [s]; to write.
        opened: 1 for a hand whose grasp has opened, else 0 (2,); to write.
    """
    if not (is_finite(h_1) and is_finite(h_2)):
        return False
    for k in range(2):
        size = wrench_size(h_1 if k == 0 else h_2, thresholds[0], thresholds[1])
        since_loaded = 0.0 if size >= thresholds[2] else before[k] + period
        empty = 0.0 if size >= 1.0 else before[2 + k] + period
        times[k], times[2 + k] = since_loaded, empty
        # The hand is empty from the first empty sample on; half a period allows for rounding.
        held_empty = empty - period
        fell = since_loaded - held_empty < limits[0] + 0.5 * period
        opened[k] = 1.0 if fell and held_empty > limits[1] - 0.5 * period else 0.0
    return True
