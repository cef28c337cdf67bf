"""Explicit Euler, and the number of its steps in a given time."""

import math

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.typing import Array

__all__ = ["explicit_euler", "steps_of"]

# A time that is longer by this share of a step still counts as a whole number of steps.
_ROUNDING = 1e-6


@compilable
def explicit_euler(state: Array, rate: Array, step: float) -> None:
    """Advances a state to x + Δt ẋ. Floats only.

    Args:
        state: x (n,), overwritten.
        rate: ẋ (n,).
        step: Δt [s].
    """
    for k in range(len(state)):
        state[k] += step * rate[k]


def steps_of(elapsed: float, longest: float) -> int:
    """Returns the number of equal steps in a time, none of them longer than the longest.

    Args:
        elapsed: [s].
        longest: [s].
    """
    return max(1, math.ceil(elapsed / longest - _ROUNDING))
