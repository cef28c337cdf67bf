"""The joint acceleration of a redundant arm from the acceleration of its end effector."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.typing import Array

__all__ = ["redundant_acceleration"]


@compilable
def redundant_acceleration(J_pinv: Array, a: Array, Jdot_v: Array, alpha_n: Array) -> Array:
    """Returns (3.32) α = J†(a − J̇q̇) + α_n (n,), which gives (2.6) v̇_e = a whatever α_n is.

    Args:
        J_pinv: J† (n, 6).
        a: the desired acceleration [a_o; a_p] (6,) of the end effector [rad/s², m/s²].
        Jdot_v: bias acceleration J̇q̇ (6,).
        alpha_n: null-space joint acceleration (n,) with Jα_n = 0 [rad/s², m/s²].
    """
    return J_pinv @ (a - Jdot_v) + alpha_n
