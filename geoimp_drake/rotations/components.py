"""Small arrays taken apart into scalars, and put together.

Arithmetic on Python scalars is several times faster than on the entries of an array, and the laws
run every millisecond. Compiled, the entries are read where they are.
"""

from typing import Any

import numpy as np

from geoimp_drake.compiled import compilable, compilable_as
from geoimp_drake.typing import Array

__all__ = ["Row", "composed", "matrix", "rows", "turned", "wxyz", "xyz"]


Row = tuple[Any, Any, Any]


def _read_xyz(a: Array) -> Row:
    return a[0], a[1], a[2]


def _read_wxyz(Q: Array) -> tuple[Any, Any, Any, Any]:
    return Q[0], Q[1], Q[2], Q[3]


def _read_rows(R: Array) -> tuple[Row, Row, Row]:
    return _read_row(R, 0), _read_row(R, 1), _read_row(R, 2)


def _filled(first: Row, second: Row, third: Row) -> Array:
    R = np.empty((3, 3))
    R[0, 0], R[0, 1], R[0, 2] = first
    R[1, 0], R[1, 1], R[1, 2] = second
    R[2, 0], R[2, 1], R[2, 2] = third
    return R


def _composed(A: Array, B: Array) -> Array:
    C = np.empty((3, 3))
    for i in range(3):
        for k in range(3):
            C[i, k] = A[i, 0] * B[0, k] + A[i, 1] * B[1, k] + A[i, 2] * B[2, k]
    return C


def _turned(A: Array, b: Array) -> Array:
    c = np.empty(3)
    for i in range(3):
        c[i] = A[i, 0] * b[0] + A[i, 1] * b[1] + A[i, 2] * b[2]
    return c


@compilable_as(_read_xyz)
def xyz(a: Array) -> Row:
    """The three entries of the vector `a` (3,)."""
    x, y, z = a.tolist()
    return x, y, z


@compilable_as(_read_wxyz)
def wxyz(Q: Array) -> tuple[Any, Any, Any, Any]:
    """The four entries η, εx, εy, εz of the quaternion `Q` (4,)."""
    w, x, y, z = Q.tolist()
    return w, x, y, z


@compilable_as(_read_rows)
def rows(R: Array) -> tuple[Row, Row, Row]:
    """The three rows of the matrix `R` (3, 3), each with its three entries."""
    first, second, third = R.tolist()
    return first, second, third


@compilable
def _read_row(R: Array, k: int) -> Row:
    return R[k, 0], R[k, 1], R[k, 2]


@compilable_as(_filled)
def matrix(first: Row, second: Row, third: Row) -> Array:
    """The matrix (3, 3) with the given rows."""
    return np.array((first, second, third))


@compilable_as(_composed)
def composed(A: Array, B: Array) -> Array:
    """The product A B (3, 3) of two matrices; compiled, it does not go to BLAS."""
    return A @ B


@compilable_as(_turned)
def turned(A: Array, b: Array) -> Array:
    """The product A b (3,) of a matrix (3, 3) and a vector; compiled, it does not go to BLAS."""
    return A @ b
