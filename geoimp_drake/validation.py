"""Checks of what a user writes into a configuration; each error names the field and the number."""

import difflib
from collections.abc import Iterable
from typing import Any

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.typing import Array

__all__ = [
    "choice",
    "finite_array",
    "finite_vector",
    "non_negative",
    "positive",
    "spd_matrix",
    "unknown_name",
]

_SYMMETRY_TOLERANCE = 1e-9


def positive(value: float, name: str, unit: str = "") -> None:
    """Raises ConfigurationError unless a number is positive and finite."""
    if not (np.isfinite(value) and value > 0):
        raise ConfigurationError(f"{name} is {value:g} {unit}; it must be positive and finite.")


def non_negative(value: float, name: str, unit: str = "") -> None:
    """Raises ConfigurationError unless a number is zero or positive, and finite."""
    if not (np.isfinite(value) and value >= 0):
        raise ConfigurationError(f"{name} is {value:g} {unit}; it must be zero or positive.")


def finite_array(value: Array, name: str, shape: tuple[int, ...]) -> Array:
    """Returns an array of finite numbers; raises ConfigurationError for any other."""
    wanted = "×".join(str(size) for size in shape)
    array = _numbers(value, name, f"{wanted} finite numbers")
    if array.shape != shape or not np.isfinite(array).all():
        raise ConfigurationError(f"{name} is {array.tolist()}; give {wanted} finite numbers.")
    return array


def finite_vector(value: Array, name: str, size: int) -> Array:
    """Returns a vector of `size` finite numbers; raises ConfigurationError for anything else."""
    return finite_array(value, name, (size,))


def spd_matrix(value: Array, name: str, size: int = 3) -> Array:
    """Returns a gain as a symmetric positive definite matrix.

    Args:
        value: a number k for k I, a vector for a diagonal, or the whole matrix.
        name: of the field, for the error.
        size: of the matrix.

    Raises:
        ConfigurationError: wrong shape, NaN or infinite, not symmetric, or not positive definite.
    """
    given = _numbers(value, name, f"one number, {size} numbers or a {size}×{size} matrix")
    if not np.isfinite(given).all():
        raise ConfigurationError(f"{name} is {given.tolist()}; every entry must be finite.")
    if given.shape == ():
        matrix = float(given) * np.eye(size)
    elif given.shape == (size,):
        matrix = np.diag(given)
    elif given.shape == (size, size):
        matrix = given
    else:
        raise ConfigurationError(
            f"{name} has shape {given.shape}; give one number, {size} numbers (the diagonal) or a "
            f"{size}×{size} matrix."
        )
    asymmetry = np.abs(matrix - matrix.T).max()
    if asymmetry > _SYMMETRY_TOLERANCE * max(1.0, np.abs(matrix).max()):
        raise ConfigurationError(
            f"{name} is not symmetric: an entry differs from its mirror image by {asymmetry:.3g}."
        )
    smallest = float(np.linalg.eigvalsh(matrix)[0])
    if smallest <= 0:
        raise ConfigurationError(
            f"{name} is not positive definite: its smallest eigenvalue is {smallest:.6g}. "
            f"Give one with positive eigenvalues only."
        )
    return matrix


def _numbers(value: Any, name: str, wanted: str) -> Array:
    """Returns what a user gave as an array; raises ConfigurationError for text and ragged rows."""
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ConfigurationError(f"{name} is {value!r}; give {wanted}.") from None


def choice(value: str, name: str, valid: Iterable[str]) -> None:
    """Raises ConfigurationError unless `value` is one of the valid names."""
    if value not in (names := list(valid)):
        raise unknown_name(value, name, names)


def unknown_name(value: str, name: str, valid: Iterable[str]) -> ConfigurationError:
    """Returns the error for a name that is not known: the valid ones, the nearest first of all."""
    names = sorted(valid)
    near = difflib.get_close_matches(value, names, n=1)
    hint = f" Did you mean '{near[0]}'?" if near else ""
    return ConfigurationError(f"Unknown {name} '{value}'.{hint} Valid: {', '.join(names)}.")
