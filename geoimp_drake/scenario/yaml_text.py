"""YAML to plain data: one reader for all YAML of this library, in bounded time and memory.

A text becomes dictionaries with names as keys, lists, numbers, truth values and texts. Tags are
refused, so nothing is constructed that the schema does not ask for. YAML 1.1 reads some values in a
way that people do not expect: `010` (octal), `1:30` (base 60), `2024-01-01` and `on`. Here these,
and whole numbers of more than 18 digits, stay texts, which the schema then takes for numbers or
refuses.
"""

import copy
import re
from collections.abc import Iterator
from typing import Any

import yaml

from geoimp_drake.errors import ConfigurationError, one_line
from geoimp_drake.validation import key, quoted

__all__ = ["parse_yaml"]

# The nodes that an alias stands for count each time.
_MOST_NODES, _DEEPEST = 20_000, 30

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # the first is libyaml's, if it is there

_CONSTANTS = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_WHOLE = re.compile(r"[-+]?(0|[1-9][0-9]{0,17})", re.ASCII)
_REAL = re.compile(r"[-+]?([0-9]+\.[0-9]*|\.[0-9]+)([eE][-+][0-9]+)?", re.ASCII)
_SPECIAL = re.compile(r"([-+]?)\.(inf|Inf|INF|nan|NaN|NAN)")


def parse_yaml(text: str, name: str, lines: dict[str, int] | None = None) -> Any:
    """Returns the data of a YAML text.

    Args:
        text: one document.
        name: of the text, for errors.
        lines: is filled with the line number of each key and entry, by its path.

    Raises:
        ConfigurationError: the text is no YAML, or has a tag, a key that is no text, or one that
            occurs twice. Or it has more than 20,000 values or 30 levels. The message has the lines.
    """
    try:
        return _Reader(text, name, {} if lines is None else lines).document()
    except yaml.YAMLError as error:
        raise ConfigurationError(f"{name} is not YAML: {_problem(error)}") from None
    except UnicodeError as error:
        raise ConfigurationError(f"{name} is not YAML: {error}") from None


def _problem(error: yaml.YAMLError) -> str:
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:
        mark = error.problem_mark
        return f"line {mark.line + 1}, column {mark.column + 1}: {error.problem}"
    return one_line(error)


class _Reader:
    """Builds data from the parser's events, one by one."""

    def __init__(self, text: str, name: str, lines: dict[str, int]):
        self._lines = lines
        self._name = name
        self._events: Iterator[Any] = yaml.parse(text, Loader=_LOADER)
        self._anchored: dict[str, tuple[Any, int]] = {}
        self._nodes = 0

    def document(self) -> Any:
        """Returns the data of the only document; None if there is none."""
        next(self._events)  # the stream starts
        if isinstance(next(self._events), yaml.StreamEndEvent):
            return None
        value = self._value(next(self._events), "", 0)
        next(self._events)  # the document ends
        if not isinstance(more := next(self._events), yaml.StreamEndEvent):
            raise self._error(more, "a second document begins; give one")
        return value

    def _value(self, event: Any, path: str, depth: int) -> Any:
        if depth > _DEEPEST:
            raise self._error(event, f"more than {_DEEPEST} levels")
        before = self._nodes
        self._count(event, 1)
        if isinstance(event, yaml.AliasEvent):
            return self._copied(event)
        if event.tag is not None:
            raise self._error(event, f"the tag {quoted(event.tag)} is not read; give plain values")
        value = self._untagged(event, path, depth)
        if event.anchor is not None:
            self._anchored[event.anchor] = (value, self._nodes - before)
        return value

    def _untagged(self, event: Any, path: str, depth: int) -> Any:
        if isinstance(event, yaml.MappingStartEvent):
            return self._mapping(path, depth)
        if isinstance(event, yaml.SequenceStartEvent):
            return self._sequence(path, depth)
        plain, _ = event.implicit
        return _scalar(event.value) if plain else event.value

    def _mapping(self, path: str, depth: int) -> dict[str, Any]:
        value: dict[str, Any] = {}
        merged: dict[str, Any] = {}
        while not isinstance(event := next(self._events), yaml.MappingEndEvent):
            name = self._key(event)
            where = key(path, name)
            if name in value:
                raise self._error(
                    event, f"{quoted(where)} is in line {self._lines[where]} already; leave one out"
                )
            part = self._value(next(self._events), where, depth + 1)
            if name == "<<" and isinstance(part, dict):
                merged |= part
            else:
                value[name] = part
                self._lines[where] = event.start_mark.line + 1
        return {**merged, **value}

    def _sequence(self, path: str, depth: int) -> list[Any]:
        value: list[Any] = []
        while not isinstance(event := next(self._events), yaml.SequenceEndEvent):
            where = key(path, str(len(value)))
            self._lines[where] = event.start_mark.line + 1
            value.append(self._value(event, where, depth + 1))
        return value

    def _key(self, event: Any) -> str:
        name = self._value(event, "", 0) if isinstance(event, yaml.ScalarEvent) else None
        if not isinstance(name, str):
            written = getattr(event, "value", "a collection")
            raise self._error(event, f"the key {quoted(written)} is no name; write it as a text")
        return name

    def _copied(self, event: Any) -> Any:
        if event.anchor not in self._anchored:
            raise self._error(event, f"*{quoted(event.anchor)} stands for nothing before it")
        value, size = self._anchored[event.anchor]
        self._count(event, size)
        return copy.deepcopy(value)

    def _count(self, event: Any, nodes: int) -> None:
        self._nodes += nodes
        if self._nodes > _MOST_NODES:
            raise self._error(event, f"more than {_MOST_NODES} values, aliases counted")

    def _error(self, event: Any, message: str) -> ConfigurationError:
        return ConfigurationError(f"{self._name}, line {event.start_mark.line + 1}: {message}.")


def _scalar(text: str) -> Any:
    """Returns the value of a plain text."""
    if text in _CONSTANTS:
        return _CONSTANTS[text]
    if _WHOLE.fullmatch(text):
        return int(text)
    if _REAL.fullmatch(text):
        return float(text)
    if special := _SPECIAL.fullmatch(text):
        return float("".join(special.groups()))
    return text
