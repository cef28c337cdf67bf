"""How fast a constant gain makes the null-space motion decay at one posture."""

from collections.abc import Callable
from functools import cache

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import sized, stored
from geoimp_drake.laws.dynamics.linear_equations import inverse
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import (
    pseudo_inverse_with,
    singular_value_or_bound,
)
from geoimp_drake.laws.redundancy.null_space_gain import null_space_decay, null_space_decay_bound
from geoimp_drake.typing import Array

__all__ = ["null_space_rates"]


@cache
def null_space_rates(n: int) -> Callable[..., tuple[Array, float]]:
    """Returns the law of an arm of n > 6 joints."""

    @compilable
    def law(
        columns: Array,
        inertia: Array,
        K: Array,
        W_inverse: Array,
        weighs_by_inertia: bool,
        threshold: float,
        factor: float,
    ) -> tuple[Array, float]:
        """Returns `null_space_decay` (n, n) and `null_space_decay_bound`.

        Args:
            columns: Jacobian (6, n).
            inertia: B (n, n).
            K: K_n (n, n).
            W_inverse: inverse of a constant weight (n, n).
            weighs_by_inertia: (3.36) W = B instead.
            threshold: σ₀ of `damped_pseudo_inverse`.
            factor: λ₀ of the same.
        """
        J, B_inverse = sized(columns, 6, n), inverse(sized(inertia, n, n))
        weight = B_inverse if weighs_by_inertia else sized(W_inverse, n, n)
        sigma = singular_value_or_bound(J, threshold)
        _, N = pseudo_inverse_with(J, weight, sigma, threshold, factor)
        K_n = sized(K, n, n)
        bound = null_space_decay_bound(N, B_inverse, K_n)
        return stored(null_space_decay(N, B_inverse, K_n)), bound

    return law
