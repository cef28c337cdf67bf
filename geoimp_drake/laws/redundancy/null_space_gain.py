"""The gain K_n of the null-space velocity error: a matrix, or a rate times the joint inertia."""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import local
from geoimp_drake.typing import Array

__all__ = ["null_space_decay", "null_space_decay_bound", "null_space_force"]


@compilable
def null_space_force(K: Array, kappa: float, B: Array, e_n: Array) -> Array:
    """Returns K_n e_n of (3.38) (n,) [Nm, N] for K_n = K + κB.

    With K = 0 the energy V = ½ e_nᵀBe_n obeys V̇ = −e_nᵀK_n e_n = −2κV, in any posture of any arm.

    Args:
        K: the part that does not depend on the posture (n, n).
        kappa: rate κ [1/s].
        B: joint inertia (n, n).
        e_n: null-space velocity error (n,).
    """
    return K @ e_n + kappa * (B @ e_n)


@compilable
def null_space_decay(N: Array, B_inverse: Array, K: Array) -> Array:
    """Returns A (n, n) of ė_n = −A e_n, what (3.38) does with a constant K_n: NB⁻¹K_n.

    Its eigenvalues that are not zero are the n − 6 rates of decay [1/s]. Where joints are read
    and torques held for a period T, e_n grows if T times a rate exceeds 2.

    Args:
        N: null-space projector (n, n).
        B_inverse: inverse of the joint inertia (n, n).
        K: K_n (n, n).
    """
    return N @ B_inverse @ K


@compilable
def null_space_decay_bound(N: Array, B_inverse: Array, K: Array) -> float:
    """Returns the trace of `null_space_decay` for (3.38) [1/s]; the arguments are the same.

    With W = B, or with multiples of the unit matrix for W and K, no rate of decay is negative. So
    none is above their sum, which with seven joints is the only rate. Other pairs of W and K may
    have negative rates.
    """
    return np.trace(local(null_space_decay(N, B_inverse, K)))
