"""Small arrays taken apart into scalars.

Arithmetic on Python scalars is several times faster than on the entries of an array, and the laws
run every millisecond. Compiled, the entries are read where they are.
"""

from typing import Any

from geoimp_drake.compilation.compiled import compilable_as
from geoimp_drake.compilation.small_arrays import Row
from geoimp_drake.typing import Array

__all__ = ["rows", "wxyz", "xyz"]


def _read_xyz(a: Array) -> Row:
    return a[0], a[1], a[2]


def _read_wxyz(Q: Array) -> tuple[Any, Any, Any, Any]:
    return Q[0], Q[1], Q[2], Q[3]


def _read_rows(R: Array) -> tuple[Row, Row, Row]:
    first, second = (R[0, 0], R[0, 1], R[0, 2]), (R[1, 0], R[1, 1], R[1, 2])
    return first, second, (R[2, 0], R[2, 1], R[2, 2])


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
