"""One walk through a configuration; names and types of fields follow from the annotations.

A configuration is a plain dataclass. `check` walks through it and all that it contains. Each
dataclass's `validate` adds rules for its own fields.
"""

import contextlib
import dataclasses
import types
import typing
from collections.abc import Mapping
from typing import Any

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.validation.values import (
    LONGEST_NAME,
    LONGEST_PATH,
    MOST_DIGITS,
    check_size,
    check_text,
    key,
    quoted,
    unknown_name,
)

__all__ = [
    "PATH",
    "UNBOUNDED",
    "check",
    "check_data",
    "field_types",
    "without_optional",
]

# Metadata of a field that may be infinite, and of one whose texts are paths, which may be longer.
UNBOUNDED = {"unbounded": True}
PATH = {"path": True}

_NO_MARKS: Mapping[Any, Any] = {}

_WANTED = {
    float: "a number",
    int: f"a whole number of at most {MOST_DIGITS} digits",
    str: "a text",
    bool: "true or false",
}


def check(config: Any, path: str = "") -> None:
    """Raises ConfigurationError if a configuration, or one that it contains, cannot be used.

    A dataclass may have a `validate(name)` for its own fields and the rules between them. Its parts
    have been checked by then.

    Args:
        config: a dataclass.
        path: its key in the user's text, put before the names of its fields.
    """
    _walk(type(config), config, path, data=False)


def check_data(schema: Any, data: Any, path: str = "") -> None:
    """Raises ConfigurationError if YAML's data do not fit a schema; keys may be missing."""
    _walk(schema, data, path, data=True)


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
            check_text(str(name), f"a name in {path}", LONGEST_NAME)
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
    """Returns the parts of a configuration by name; Drake's have only their fields."""
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
        int: array.dtype.kind in "iu" and array.ndim == 0 and abs(int(array)) < 10**MOST_DIGITS,
        str: isinstance(value, str),
        bool: isinstance(value, bool | np.bool_),
    }
    if not fits.get(kind, numeric):
        wanted = _WANTED.get(kind, "a number, or numbers in lists of equal length")
        raise ConfigurationError(f"{path} is {quoted(value)}; give {wanted}.")
    if kind is str:
        check_text(value, path, LONGEST_PATH if "path" in marks else LONGEST_NAME)
    elif numeric and kind is not int:
        check_size(array, path, unbounded="unbounded" in marks)


def _check_datum(kind: Any, datum: Any, path: str, marks: Mapping[Any, Any]) -> None:
    """Does the same as `_check_value` for YAML data, in which 1e-3 is a text: it has no point."""
    if kind not in (bool, int, str) and not isinstance(datum, bool):
        with contextlib.suppress(TypeError, ValueError, OverflowError):
            datum = np.asarray(datum, dtype=float).tolist()
    _check_value(kind, datum, path, marks)
