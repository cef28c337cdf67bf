"""The weighted pseudo-inverse that stays bounded near kinematic singularities."""

from dataclasses import dataclass

import numpy as np

from geoimp_drake.compilation.compiled import compilable, compilable_as
from geoimp_drake.compilation.small_arrays import local, numbers, sized_like, stored
from geoimp_drake.laws.redundancy.pseudo_inverse import (
    null_space_projector,
    weighted_pseudo_inverse,
)
from geoimp_drake.typing import Array
from geoimp_drake.validation import key, non_negative, positive

__all__ = [
    "SingularityDamping",
    "damped_pseudo_inverse",
    "pseudo_inverse_with",
    "singular_value_or_bound",
    "smallest_singular_value",
]


@dataclass
class SingularityDamping:
    """When and how much the pseudo-inverse is damped.

    Singular values are those of the Jacobian as it stands, rotations in rad and lengths in m.
    """

    threshold: float = 0.01  # σ₀: nothing at all happens while no singular value is below it
    factor: float = 0.01  # λ₀: what replaces 1/σ is at most the larger of 1/σ₀ and 1/(√2 λ₀)

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        non_negative(self.threshold, key(name, "threshold"))
        if self.threshold > 0:
            positive(self.factor, key(name, "factor"))


def _smallest_singular_value(J: Array) -> float:
    _, singular_values, _ = np.linalg.svd(stored(J), full_matrices=False)
    return float(singular_values[-1])


@compilable_as(_smallest_singular_value)
def smallest_singular_value(J: Array) -> float:
    """Returns the smallest singular value of J (6, n), the distance from a singularity."""
    if J.dtype == float:
        return _smallest_singular_value(J)
    # σ = uᵀJv, in which the derivatives of u and v cancel.
    U, _, Vt = np.linalg.svd(numbers(J), full_matrices=False)
    return U[:, -1] @ J @ Vt[-1]


@compilable
def singular_value_or_bound(J: Array, threshold: float) -> float:
    """Returns the smallest singular value σ of J (6, n), or a lower bound that reaches a threshold.

    The bound is much faster to compute, and nearly always suffices. Floats only.
    """
    bound = _lower_bound(J)
    return bound if bound >= threshold else smallest_singular_value(J)


@compilable
def _lower_bound(J: Array) -> float:
    """Returns 1/‖L⁻¹‖_F of JJᵀ = LLᵀ, which is between σ/√6 and σ; zero where there is no L."""
    squares_of_J = J @ J.T
    L, column = local(squares_of_J), local(squares_of_J[0])
    m = len(L)
    for j in range(m):
        for k in range(j):
            for i in range(j, m):
                L[i, j] -= L[i, k] * L[j, k]
        if not L[j, j] > 0.0:
            return 0.0
        pivot = np.sqrt(L[j, j])
        for i in range(j, m):
            L[i, j] /= pivot
    squares = 0.0
    for j in range(m):  # the columns of L⁻¹
        for i in range(j, m):
            rest = 1.0 if i == j else 0.0
            for k in range(j, i):
                rest -= L[i, k] * column[k]
            column[i] = rest / L[i, i]
            squares += column[i] ** 2
    return 1.0 / np.sqrt(squares)


def damped_pseudo_inverse(
    J: Array, W_inverse: Array, sigma: float, damping: SingularityDamping
) -> tuple[Array, Array]:
    """Returns J† (n, 6) and the null-space projector N (n, n). Floats only.

    Above the threshold they are (3.33) and I − J†J, the same numbers to the bit. With J = UΣVᵀ and
    V† the weighted pseudo-inverse of Vᵀ, (3.33) is V†Σ⁻¹Uᵀ. Below the threshold each σᵢ < σ₀ is
    inverted as σᵢ/(σᵢ² + λᵢ²), λᵢ² = λ₀²(1 − σᵢ²/σ₀²). So only the motion in nearly lost directions
    slows down. N = I − V†Vᵀ is not damped, so JN = 0 holds throughout.

    Args:
        J: Jacobian of the end effector (6, n), its rows [angular; linear], in W.
        W_inverse: inverse of the weight, symmetric positive definite (n, n).
        sigma: smallest singular value of J, or a lower bound of it that reaches the threshold.
        damping: threshold σ₀ and factor λ₀.
    """
    return pseudo_inverse_with(J, W_inverse, sigma, damping.threshold, damping.factor)


@compilable
def pseudo_inverse_with(
    J: Array, W_inverse: Array, sigma: float, threshold: float, factor: float
) -> tuple[Array, Array]:
    """Returns what `damped_pseudo_inverse` returns, with σ₀ and λ₀ as numbers."""
    if sigma >= threshold:
        J_pinv = weighted_pseudo_inverse(J, W_inverse)
        return J_pinv, null_space_projector(J, J_pinv)
    U, s, Vt = np.linalg.svd(stored(J), full_matrices=False)
    V_pinv = weighted_pseudo_inverse(Vt, stored(W_inverse))
    weakness = np.maximum(0.0, 1.0 - (s / threshold) ** 2)
    inverse = s / (s**2 + factor**2 * weakness)
    J_pinv = (V_pinv * inverse) @ U.T
    return sized_like(J_pinv, J.T), sized_like(null_space_projector(Vt, V_pinv), W_inverse)
