"""Checks of single numbers, arrays and texts; each error names the field and the number.

No number may be larger than 10¹², and no positive number smaller than 10⁻¹². SI units leave that
much room, and squares and quotients stay finite. A text is a name: 100 characters at most, all
printable.
"""

import difflib
import reprlib
from collections.abc import Iterable
from typing import Any

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.typing import Array

__all__ = [
    "LARGEST",
    "LARGEST_SEED",
    "LONGEST_NAME",
    "LONGEST_PATH",
    "MOST_DIGITS",
    "check_size",
    "check_text",
    "choice",
    "finite_array",
    "finite_vector",
    "key",
    "non_negative",
    "positive",
    "positive_vector",
    "quoted",
    "spd_matrix",
    "symmetric",
    "unknown_name",
    "whole_number",
]

# Error of symmetry after products in single precision, as a fraction of the largest entry.
_SYMMETRY_TOLERANCE = 1e-6

LARGEST = 1e12
_SMALLEST = 1e-12  # of what must be positive
_RANGE = f"from {_SMALLEST:g} to {LARGEST:g}"
MOST_DIGITS = 18
LARGEST_SEED = 10**MOST_DIGITS - 1
LONGEST_NAME, LONGEST_PATH = 100, 4096

# A matrix is quoted whole.
_QUOTES = reprlib.Repr()
_QUOTES.maxstring = _QUOTES.maxother = _QUOTES.maxlong = 100
_QUOTES.maxlist = _QUOTES.maxtuple = 36


def quoted(value: Any) -> str:
    """Returns what a user wrote in the form for an error: on one line, with its middle left out."""
    return _QUOTES.repr(value)


def key(name: str, field: str) -> str:
    """Returns the path of a field of the configuration at `name`, which is empty at the top."""
    return f"{name}.{field}" if name else field


def check_text(text: str, path: str, longest: int) -> None:
    """Raises ConfigurationError if a text is longer than so many characters, or not printable."""
    if len(text) > longest or not text.isprintable():
        raise ConfigurationError(
            f"{path} is {quoted(text)}, {len(text)} characters; give at most {longest}, all "
            f"printable."
        )


def check_size(array: Array, name: str, *, unbounded: bool = False) -> None:
    """Raises ConfigurationError if a number is too large, or not finite and not `unbounded`."""
    if not np.isfinite(array).all() and not (unbounded and not np.isnan(array).any()):
        raise ConfigurationError(f"{name} is {quoted(array.tolist())}; it must be finite.")
    if (np.isfinite(array) & (np.abs(array) > LARGEST)).any():
        raise ConfigurationError(
            f"{name} is {quoted(array.tolist())}; give numbers of at most {LARGEST:g} in size."
        )


def positive(value: float, name: str, unit: str = "") -> None:
    """Raises ConfigurationError unless a number is positive, from 1e-12 to 1e12."""
    if not _SMALLEST <= value <= LARGEST:
        raise ConfigurationError(
            f"{name} is {value:g}{_after(unit)}; it must be positive, {_RANGE}."
        )


def non_negative(value: float, name: str, unit: str = "") -> None:
    """Raises ConfigurationError unless a number is zero, or positive from 1e-12 to 1e12."""
    if value != 0 and not _SMALLEST <= value <= LARGEST:
        raise ConfigurationError(
            f"{name} is {value:g}{_after(unit)}; it must be zero or positive, {_RANGE}."
        )


def _after(unit: str) -> str:
    return f" {unit}" if unit else ""


def positive_vector(value: Array, name: str, size: int | None = None) -> Array:
    """Returns a vector of positive numbers, of `size` or any; raises ConfigurationError for others.

    The numbers must be from 1e-12 to 1e12.
    """
    vector = finite_vector(value, name, np.size(value) if size is None else size)
    if not (vector >= _SMALLEST).all():
        raise ConfigurationError(
            f"{name} is {quoted(vector.tolist())}; all must be positive, {_RANGE}."
        )
    return vector


def whole_number(value: int, name: str, least: int, most: int) -> None:
    """Raises ConfigurationError unless a value is a whole number in a range, both ends included."""
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not (whole and least <= value <= most):
        raise ConfigurationError(
            f"{name} is {quoted(value)}; give a whole number from {least} to {most}."
        )


def finite_array(value: Array, name: str, shape: tuple[int, ...]) -> Array:
    """Returns an array of finite numbers; raises ConfigurationError for any other."""
    wanted = "×".join(str(size) for size in shape)
    array = _numbers(value, name, f"{wanted} finite numbers")
    if array.shape != shape or not np.isfinite(array).all():
        raise ConfigurationError(
            f"{name} is {quoted(array.tolist())}; give {wanted} finite numbers."
        )
    check_size(array, name)
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
        ConfigurationError: the matrix has a wrong shape, is not finite, not symmetric, or not
            positive definite.
    """
    given = _numbers(value, name, f"one number, {size} numbers or a {size}×{size} matrix")
    check_size(given, name)
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
    matrix = symmetric(matrix, name)
    smallest = float(np.linalg.eigvalsh(matrix)[0])
    if smallest < _SMALLEST:
        raise ConfigurationError(
            f"{name} is not positive definite: its smallest eigenvalue is {smallest:.6g}. "
            f"Give one with positive eigenvalues only, from {_SMALLEST:g} on."
        )
    return matrix


def symmetric(matrix: Array, name: str) -> Array:
    """Returns a square matrix without the asymmetry that rounding left.

    Raises:
        ConfigurationError: the asymmetry is larger than that.
    """
    asymmetry = np.abs(matrix - matrix.T).max()
    if asymmetry > _SYMMETRY_TOLERANCE * np.abs(matrix).max():
        raise ConfigurationError(
            f"{name} is not symmetric: an entry differs from its mirror image by {asymmetry:.3g}."
        )
    return 0.5 * (matrix + matrix.T)


def _numbers(value: Any, name: str, wanted: str) -> Array:
    """Returns what a user gave as an array; raises ConfigurationError for text and ragged rows."""
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ConfigurationError(f"{name} is {quoted(value)}; give {wanted}.") from None


def choice(value: str, name: str, valid: Iterable[str]) -> None:
    """Raises ConfigurationError unless `value` is one of the valid names."""
    if value not in (names := list(valid)):
        raise unknown_name(value, name, names)


def unknown_name(value: str, name: str, valid: Iterable[str]) -> ConfigurationError:
    """Returns the error for an unknown name; it lists the valid ones, the nearest first."""
    names = sorted(valid)
    near = difflib.get_close_matches(value, names, n=1)
    hint = f" Did you mean '{near[0]}'?" if near else ""
    return ConfigurationError(f"Unknown {name} {quoted(value)}.{hint} Valid: {', '.join(names)}.")
