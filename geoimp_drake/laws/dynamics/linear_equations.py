"""The solution of a few linear equations, and the inverse of an inertia.

Uncompiled, they call LAPACK. Compiled, they use the elimination below. For six or seven equations
numba's way to LAPACK takes longer to compile than the laws that need it, and longer to run. LAPACK
knows no `AutoDiffXd`, so equations of these are eliminated, too.
"""

import numpy as np

from geoimp_drake.compilation.compiled import compilable, compilable_as
from geoimp_drake.compilation.small_arrays import identity_like, local, sized_like
from geoimp_drake.typing import Array

__all__ = ["inverse", "solution"]


@compilable
def _eliminate(A: Array, B: Array, exchanges_rows: bool) -> None:
    """Gaussian elimination in place: A becomes upper triangular, and B becomes A⁻¹B."""
    n, columns = B.shape
    for k in range(n):
        pivot = k
        if exchanges_rows:
            for i in range(k + 1, n):
                if abs(A[i, k]) > abs(A[pivot, k]):
                    pivot = i
        if A[pivot, k] == 0.0:
            raise np.linalg.LinAlgError("Singular matrix")
        for j in range(k, n):
            A[k, j], A[pivot, j] = A[pivot, j], A[k, j]
        for j in range(columns):
            B[k, j], B[pivot, j] = B[pivot, j], B[k, j]
        for i in range(k + 1, n):
            part = A[i, k] / A[k, k]
            for j in range(k, n):
                A[i, j] -= part * A[k, j]
            for j in range(columns):
                B[i, j] -= part * B[k, j]
    for i in range(n - 1, -1, -1):
        for j in range(columns):
            rest = B[i, j]
            for k in range(i + 1, n):
                rest -= A[i, k] * B[k, j]
            B[i, j] = rest / A[i, i]


def _eliminated_solution(A: Array, b: Array) -> Array:
    x = local(b)
    _eliminate(local(A), x.reshape(-1, 1), True)
    return sized_like(x, b)


def _eliminated_inverse(A: Array) -> Array:
    X = local(identity_like(A))
    _eliminate(local(A), X, False)
    return sized_like(X, A)


@compilable_as(_eliminated_solution)
def solution(A: Array, b: Array) -> Array:
    """Returns x (n,) with A x = b.

    Args:
        A: square matrix (n, n).
        b: right-hand side (n,).

    Raises:
        numpy.linalg.LinAlgError: A is exactly singular.
    """
    if A.dtype == b.dtype == float:
        return np.linalg.solve(A, b)
    return _eliminated_solution(A.astype(object), b.astype(object))


@compilable_as(_eliminated_inverse)
def inverse(A: Array) -> Array:
    """Returns A⁻¹ (n, n) of a symmetric positive definite matrix.

    The elimination takes its pivots from the diagonal in order. So the units of the rows, such as
    metres and radians, have no influence.

    Args:
        A: symmetric positive definite (n, n).

    Raises:
        numpy.linalg.LinAlgError: A is exactly singular.
    """
    if A.dtype == float:
        return np.linalg.inv(A)
    X = np.eye(len(A)).astype(object)
    _eliminate(A.copy(), X, False)
    return X
