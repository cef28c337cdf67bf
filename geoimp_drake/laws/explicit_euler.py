"""Explicit Euler, and how many steps of it there are in a time."""

import math

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.typing import Array

__all__ = ["explicit_euler", "steps_of"]

# A time this share of a step longer is still one of a whole number of steps.
_ROUNDING = 1e-6


@compilable
def explicit_euler(state: Array, rate: Array, step: float) -> None:
    """Moves a state on, x + Δt ẋ. Floats only.

    Args:
        state: x (n,), overwritten.
        rate: ẋ (n,).
        step: Δt [s].
    """
    for k in range(len(state)):
        state[k] += step * rate[k]


def steps_of(elapsed: float, longest: float) -> int:
    """Returns in how many equal steps a time passes, none of them longer than the longest.

    Args:
        elapsed: [s].
        longest: [s].
    """
    return max(1, math.ceil(elapsed / longest - _ROUNDING))
