"""Small arrays of a known shape, which a compiled law keeps in registers.

Laws work on vectors, quaternions and 3×3 matrices. For numba each array is a piece of memory,
allocated, counted and released, which costs more than the arithmetic, and takes long to compile.
What these functions return is, compiled, a value: its entries and no memory at all
(`small_array_type.py`). As written, each returns an ordinary array, of `float` or `AutoDiffXd`.

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
    """The array `a` as a small array of its own shape, which is not compared when compiled.

    Do not write to `a` as long as the result is used: only compiled it is a copy.

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

    For checks, and for what has its derivatives from elsewhere.
    """
    if a.dtype == float:
        return a
    return np.array([float(entry.value()) for entry in a.ravel()]).reshape(a.shape)


def local(a: Array) -> Array:
    """A copy of `a` that may be written, as an ordinary array; it ends with the law that makes it.

    It may be passed to other laws, but not be returned: that of a small array takes no memory, and
    is on the stack.
    """
    return np.array(a)


def stored(a: Array) -> Array:
    """The array `a` as an ordinary one, in memory of its own: for LAPACK, and to be returned."""
    return a


def identity_like(A: Array) -> Array:
    """The unit matrix of the size of a square matrix (n, n)."""
    return np.eye(len(A))
