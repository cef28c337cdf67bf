"""Checks of what a user writes into a configuration; each error names the field and the number.

A configuration is a plain dataclass. `check` walks through it and all that it contains: names and
types of fields follow from the annotations, the rest is what each dataclass's `validate` says of
its own fields.

No number is larger than 10¹², and none that must be positive smaller than 10⁻¹²: SI units leave
that much room, and squares and quotients stay numbers. A text is a name: 100 characters at most,
all printable.
"""

import contextlib
import dataclasses
import difflib
import reprlib
import types
import typing
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.typing import Array

__all__ = [
    "LARGEST",
    "LARGEST_SEED",
    "PATH",
    "UNBOUNDED",
    "check",
    "check_data",
    "choice",
    "field_types",
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
    "without_optional",
]

# Of the largest entry: what is left of symmetry after products of single precision.
_SYMMETRY_TOLERANCE = 1e-6

# Metadata of a field that may be infinite, and of one whose texts are paths, longer than names.
UNBOUNDED = {"unbounded": True}
PATH = {"path": True}

LARGEST = 1e12
_SMALLEST = 1e-12  # of what must be positive
_RANGE = f"from {_SMALLEST:g} to {LARGEST:g}"
_MOST_DIGITS = 18
LARGEST_SEED = 10**_MOST_DIGITS - 1
_LONGEST_NAME, _LONGEST_PATH = 100, 4096

_NO_MARKS: Mapping[Any, Any] = {}

# A matrix is quoted whole.
_QUOTES = reprlib.Repr()
_QUOTES.maxstring = _QUOTES.maxother = _QUOTES.maxlong = 100
_QUOTES.maxlist = _QUOTES.maxtuple = 36

_WANTED = {
    float: "a number",
    int: f"a whole number of at most {_MOST_DIGITS} digits",
    str: "a text",
    bool: "true or false",
}


def check(config: Any, path: str = "") -> None:
    """Raises ConfigurationError if a configuration, or one that it contains, cannot be used.

    A dataclass may have a `validate(name)` for its own fields and the rules between them; what it
    contains has been checked by then.

    Args:
        config: a dataclass.
        path: its key in what the user wrote, put before the names of its fields.
    """
    _walk(type(config), config, path, data=False)


def check_data(schema: Any, data: Any, path: str = "") -> None:
    """Raises ConfigurationError where YAML's data do not fit a schema; keys may be left out."""
    _walk(schema, data, path, data=True)


def quoted(value: Any) -> str:
    """Returns what a user wrote as it stands in an error: in one line, its middle left out."""
    return _QUOTES.repr(value)


def key(name: str, field: str) -> str:
    """Returns the path of a field of the configuration at `name`, which is empty at the top."""
    return f"{name}.{field}" if name else field


def field_types(schema: Any) -> dict[str, Any] | None:
    """Returns the names and types of a dataclass or of one of Drake's configurations."""
    if dataclasses.is_dataclass(schema):
        return typing.get_type_hints(schema)
    if hasattr(schema, "__fields__"):
        return {f.name: f.type for f in schema.__fields__}
    return None


def without_optional(schema: Any) -> Any:
    """Returns the type T of T | None, and any other type as it is."""
    if typing.get_origin(schema) in (typing.Union, types.UnionType):
        return next(kind for kind in typing.get_args(schema) if kind is not type(None))
    return schema


def _walk(
    schema: Any, value: Any, path: str, *, data: bool, marks: Mapping[Any, Any] = _NO_MARKS
) -> None:
    """Checks a value and all its parts against a schema; a configuration is a dict in data.

    An error gets the key of the innermost value that it is about; `marks` are the field's metadata.
    """
    try:
        _check_parts(without_optional(schema), schema, value, path, data, marks)
    except ConfigurationError as error:
        first, *_ = str(error).split(" ", 1)
        error.key = error.key or (first if first.startswith(path) else path)
        raise


def _check_parts(
    kind: Any, schema: Any, value: Any, path: str, data: bool, marks: Mapping[Any, Any]
) -> None:
    if value is None and kind is not schema:
        return
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if (fields := field_types(kind)) is not None:
        _check_fields(kind, fields, value, path, data)
    elif origin is list:
        _expect(value, (list, tuple, np.ndarray), "a list", path)
        for index, part in enumerate(value):
            _walk(arguments[0], part, key(path, str(index)), data=data)
    elif origin is dict:
        _expect(value, dict, "a mapping", path)
        for name, part in value.items():
            _check_text(str(name), f"a name in {path}", _LONGEST_NAME)
            _walk(arguments[1], part, key(path, str(name)), data=data, marks=marks)
    else:
        (_check_datum if data else _check_value)(kind, value, path, marks)


def _check_fields(kind: Any, fields: dict[str, Any], value: Any, path: str, data: bool) -> None:
    whole = path or ("the scenario" if data else kind.__name__)
    if data:
        _expect(value, dict, "a mapping", whole)
    else:
        _expect(value, kind, f"of type {kind.__name__}", whole)
        kind, fields = type(value), field_types(type(value)) or fields
    marks = _marks(kind)
    for name, part in _parts(value, fields).items():
        if name not in fields:
            error = unknown_name(str(name), f"key in {whole}", fields)
            error.key = key(path, str(name))
            raise error
        _walk(fields[name], part, key(path, name), data=data, marks=marks.get(name, _NO_MARKS))
    if hasattr(value, "validate"):
        value.validate(path)


def _expect(value: Any, kind: type | tuple[type, ...], wanted: str, path: str) -> None:
    if not isinstance(value, kind):
        raise ConfigurationError(f"{path} must be {wanted}, not {quoted(value)}.")


def _parts(value: Any, fields: dict[str, Any]) -> dict[str, Any]:
    """Returns what a configuration has, by name; Drake's have nothing but their fields."""
    if isinstance(value, dict):
        return value
    if hasattr(value, "__dict__"):
        return vars(value)
    return {name: getattr(value, name) for name in fields}


def _marks(kind: Any) -> dict[str, Mapping[Any, Any]]:
    """Returns the metadata of a dataclass's fields by name."""
    fields = dataclasses.fields(kind) if dataclasses.is_dataclass(kind) else ()
    return {field.name: field.metadata for field in fields}


def _check_value(kind: Any, value: Any, path: str, marks: Mapping[Any, Any]) -> None:
    """Raises ConfigurationError unless a value is of a field's type and in its range."""
    try:
        array = np.asarray(value)
    except ValueError:  # ragged rows
        array = np.asarray(None)
    numeric = array.dtype.kind in "iuf"
    fits = {
        float: numeric and array.ndim == 0,
        int: array.dtype.kind in "iu" and array.ndim == 0 and abs(int(array)) < 10**_MOST_DIGITS,
        str: isinstance(value, str),
        bool: isinstance(value, bool | np.bool_),
    }
    if not fits.get(kind, numeric):
        wanted = _WANTED.get(kind, "a number, or numbers in lists of equal length")
        raise ConfigurationError(f"{path} is {quoted(value)}; give {wanted}.")
    if kind is str:
        _check_text(value, path, _LONGEST_PATH if "path" in marks else _LONGEST_NAME)
    elif numeric and kind is not int:
        _check_size(array, path, unbounded="unbounded" in marks)


def _check_datum(kind: Any, datum: Any, path: str, marks: Mapping[Any, Any]) -> None:
    """Does as `_check_value` with YAML's freedom: 1e-3 is a text there, for want of a point."""
    if kind not in (bool, int, str) and not isinstance(datum, bool):
        with contextlib.suppress(TypeError, ValueError, OverflowError):
            datum = np.asarray(datum, dtype=float).tolist()
    _check_value(kind, datum, path, marks)


def _check_text(text: str, path: str, longest: int) -> None:
    if len(text) > longest or not text.isprintable():
        raise ConfigurationError(
            f"{path} is {quoted(text)}, {len(text)} characters; give at most {longest}, all "
            f"printable."
        )


def _check_size(array: Array, name: str, *, unbounded: bool = False) -> None:
    """Raises ConfigurationError if a number is not finite, unless it may be, or too large."""
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

    They are from 1e-12 to 1e12.
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
    _check_size(array, name)
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
    _check_size(given, name)
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
    """Returns a square matrix with what rounding left of asymmetry taken out.

    Raises:
        ConfigurationError: more than that is there.
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
    """Returns the error for a name that is not known: the valid ones, the nearest first of all."""
    names = sorted(valid)
    near = difflib.get_close_matches(value, names, n=1)
    hint = f" Did you mean '{near[0]}'?" if near else ""
    return ConfigurationError(f"Unknown {name} {quoted(value)}.{hint} Valid: {', '.join(names)}.")
