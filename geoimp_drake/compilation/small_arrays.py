"""Small arrays of a known shape, which a compiled law keeps in registers.

Laws work on vectors, quaternions and 3×3 matrices. For numba each array is a piece of memory that
is allocated, counted and released. That costs more than the arithmetic, and takes long to compile.
Compiled, these functions return values: entries and no memory at all (`small_array_type.py`). As
written, each returns an ordinary array, of `float` or `AutoDiffXd`.

A compiled law takes its signals by `sized`. On small arrays it may use `+`, `-`, `@`, `.T`, `-a`,
products with and quotients by a number, and entries and slices at constant places. It writes its
results to slices of ordinary arrays, `motion[POSITION] = p`. See docs/concepts/compiled_laws.md.
"""

from typing import Any

import numpy as np

from geoimp_drake.typing import Array

__all__ = [
    "Row",
    "identity_like",
    "joined",
    "local",
    "matrix",
    "numbers",
    "sized",
    "sized_like",
    "stored",
    "vector",
]

Row = tuple[Any, Any, Any]


def vector(*entries: Any) -> Array:
    """The vector (n,) with the given entries."""
    return np.array(entries)


def matrix(first: Row, second: Row, third: Row) -> Array:
    """The matrix (3, 3) with the given rows."""
    return np.array((first, second, third))


def joined(first: Array, second: Array) -> Array:
    """The vector (m + n,) of the entries of two vectors (m,) and (n,)."""
    return np.concatenate((first, second))


def sized(a: Array, *shape: int) -> Array:
    """The array `a` as a small array of its own shape, which is not checked when compiled.

    Do not write to `a` as long as the result is used: it is a copy only when compiled.

    Args:
        a: an array.
        shape: its shape, of literal integers.
    """
    return a


def sized_like(a: Array, pattern: Array) -> Array:
    """The array `a`, a small array if `pattern`, which has the same shape, is one."""
    return a


def numbers(a: Array) -> Array:
    """The array `a` itself if it is one of floats, the values of one of `AutoDiffXd`.

    For checks, and for results whose derivatives come from elsewhere.
    """
    if a.dtype == float:
        return a
    return np.array([float(entry.value()) for entry in a.ravel()]).reshape(a.shape)


def local(a: Array) -> Array:
    """A writable copy of `a` as an ordinary array; it ends with the law that makes it.

    It may be passed to other laws, but not returned: the copy of a small array is on the stack and
    takes no memory.
    """
    return np.array(a)


def stored(a: Array) -> Array:
    """The array `a` as an ordinary one, in memory of its own: for LAPACK, and to be returned."""
    return a


def identity_like(A: Array) -> Array:
    """The unit matrix of the size of a square matrix (n, n)."""
    return np.eye(len(A))
