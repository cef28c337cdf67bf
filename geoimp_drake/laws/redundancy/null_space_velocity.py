"""The velocity error of the null-space motion."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.typing import Array

__all__ = ["null_space_velocity_error"]


@compilable
def null_space_velocity_error(N: Array, beta: Array, v: Array) -> Array:
    """Returns (3.37) e_n = (I − J†J)(β − q̇) (n,) [rad/s, m/s].

    Args:
        N: null-space projector I − J†J (n, n).
        beta: joint velocity β (n,) that the null-space motion follows.
        v: joint velocity q̇ (n,).
    """
    return N @ (beta - v)
