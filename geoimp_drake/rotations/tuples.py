"""Vectors as tuples of three numbers, and matrices as tuples of three rows.

Compiled they cost nothing, where a small array is allocated and counted. Floats only.
"""

import math

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import Row
from geoimp_drake.rotations.components import rows, xyz
from geoimp_drake.typing import Array

__all__ = [
    "ORIGIN",
    "UNTURNED",
    "Rows",
    "attached",
    "crossed",
    "dot",
    "plus",
    "product",
    "scaled",
    "times",
    "transposed",
    "turn",
    "write_pose",
]

Rows = tuple[Row, Row, Row]

ORIGIN: Row = (0.0, 0.0, 0.0)
UNTURNED: Rows = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@compilable
def dot(a: Row, b: Row) -> float:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compilable
def plus(a: Row, b: Row) -> Row:
    """The sum a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compilable
def scaled(k: float, a: Row) -> Row:
    """The product k a."""
    return k * a[0], k * a[1], k * a[2]


@compilable
def crossed(a: Row, b: Row) -> Row:
    """The vector product a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compilable
def times(R: Rows, a: Row) -> Row:
    """The product R a."""
    return dot(R[0], a), dot(R[1], a), dot(R[2], a)


@compilable
def transposed(R: Rows) -> Rows:
    """The transpose Rᵀ."""
    (a, b, c), (d, e, f), (g, h, i) = R
    return (a, d, g), (b, e, h), (c, f, i)


@compilable
def product(A: Rows, B: Rows) -> Rows:
    """The product A B."""
    columns = transposed(B)
    return times(columns, A[0]), times(columns, A[1]), times(columns, A[2])


@compilable
def turn(axis: Row, angle: float) -> Rows:
    """The rotation matrix by an angle about a unit vector."""
    x, y, z = axis
    c, s = math.cos(angle), math.sin(angle)
    d = 1.0 - c
    return (
        (c + d * x * x, d * x * y - s * z, d * x * z + s * y),
        (d * x * y + s * z, c + d * y * y, d * y * z - s * x),
        (d * x * z - s * y, d * y * z + s * x, c + d * z * z),
    )


@compilable
def attached(R_WM: Rows, p_WM: Row, X_MF: Array) -> tuple[Rows, Row]:
    """R_WF and p_WF of a frame F that has the pose X_MF (3, 4) in M."""
    return product(R_WM, rows(X_MF[:, :3])), plus(p_WM, times(R_WM, xyz(X_MF[:, 3])))


@compilable
def write_pose(R: Rows, p: Row, X: Array) -> None:
    """Writes the pose [R p] (3, 4)."""
    for i in range(3):
        X[i, 0], X[i, 1], X[i, 2] = R[i]
        X[i, 3] = p[i]
