"""A step of explicit Euler."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.typing import Array

__all__ = ["explicit_euler"]


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
