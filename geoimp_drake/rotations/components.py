"""The entries of small arrays as scalars.

Arithmetic on Python scalars is several times faster than on the entries of an array, and the laws
run every millisecond. These two functions are the only place that knows how the entries are taken
out, so that a compiler which cannot do it this way has one place to replace.
"""

from typing import Any

from geoimp_drake.typing import Array

__all__ = ["wxyz", "xyz"]


def xyz(a: Array) -> tuple[Any, Any, Any]:
    """The three entries of the vector `a` (3,)."""
    x, y, z = a.tolist()
    return x, y, z


def wxyz(Q: Array) -> tuple[Any, Any, Any, Any]:
    """The four entries η, εx, εy, εz of the quaternion `Q` (4,)."""
    w, x, y, z = Q.tolist()
    return w, x, y, z
