"""Small convex quadratic programs: by DAQP where it is installed, otherwise by Drake's Clarabel."""

import importlib.util
import logging
from collections.abc import Callable
from functools import cache

import numpy as np

from geoimp_drake.errors import SignalError
from geoimp_drake.extras import how_to_install
from geoimp_drake.typing import Array

__all__ = ["minimum"]

_log = logging.getLogger("drake")

# DAQP's infinity.
_INFINITE = 1e30


def minimum(H: Array, f: Array, B: Array, lower: Array, upper: Array) -> Array:
    """Returns α (n,) at the minimum of ½αᵀHα + fᵀα with bounds of α and of Bα.

    If not all bounds can be kept, those of Bα are kept, and α leaves its own by as little as
    possible. Bounds of Bα that contain a point can always be kept.

    Args:
        H: symmetric positive definite (n, n).
        f: (n,).
        B: nonsingular (n, n).
        lower: of α, then of Bα (2n,).
        upper: of the same.

    Raises:
        SignalError: there is no minimum, since a number is not finite.
    """
    bounds = np.clip(lower, -_INFINITE, _INFINITE), np.clip(upper, -_INFINITE, _INFINITE)
    alpha = _solver()(H, f, B, *bounds)
    if alpha is None:
        alpha = _nearest_to_box(H, f, B, *bounds)
    if alpha is None or not np.isfinite(alpha).all():
        raise SignalError(
            f"No joint acceleration keeps the efforts within their limits; the program's bounds of "
            f"Bα are {lower[len(f) :]} and {upper[len(f) :]}."
        )
    return alpha


def _nearest_to_box(H: Array, f: Array, B: Array, lower: Array, upper: Array) -> Array | None:
    """Returns the α that keeps the bounds of Bα and is nearest, by B, to the minimum in the box."""
    n = len(f)
    inside = _solver()(H, f, np.empty((0, n)), lower[:n], upper[:n])
    if inside is None:
        return None
    free = np.concatenate((np.full(n, -_INFINITE), lower[n:]))
    return _solver()(B, -B @ inside, B, free, np.concatenate((np.full(n, _INFINITE), upper[n:])))


@cache  # the search for a missing package goes through every path, which no tick has time for
def _solver() -> Callable[..., Array | None]:
    if importlib.util.find_spec("daqp"):
        return _by_daqp
    _log.info(f"Drake's Clarabel keeps the limits; DAQP is faster: {how_to_install('limits')}")
    return _by_clarabel


def _by_daqp(H: Array, f: Array, A: Array, lower: Array, upper: Array) -> Array | None:
    """Returns the minimum; None if there is none. Bounds beyond A's rows are the variables' own."""
    import daqp

    x, _, exit_flag, _ = daqp.solve(H, f, A, upper, lower)
    return x if exit_flag == 1 else None


def _by_clarabel(H: Array, f: Array, A: Array, lower: Array, upper: Array) -> Array | None:
    """Returns what `_by_daqp` returns."""
    from pydrake.solvers import ClarabelSolver, MathematicalProgram

    program = MathematicalProgram()
    x = program.NewContinuousVariables(len(f))
    own = len(lower) - len(A)
    program.AddQuadraticCost(H, f, x, is_convex=True)
    rows = np.concatenate((np.eye(len(f))[:own], A))
    bounded = np.abs(lower) < _INFINITE, np.abs(upper) < _INFINITE
    low = np.where(bounded[0], lower, -np.inf)
    high = np.where(bounded[1], upper, np.inf)
    program.AddLinearConstraint(rows, low, high, x)
    result = ClarabelSolver().Solve(program)
    return result.GetSolution(x) if result.is_success() else None
