"""A scenario as commented YAML, to be edited: each key has its field's comment."""

import ast
import dataclasses
import inspect
import io
import os
import textwrap
import tokenize
import typing
from collections import defaultdict
from pathlib import Path
from typing import Any

import yaml

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.output_folder import check_file, write_file
from geoimp_drake.scenario.loading import plain_data
from geoimp_drake.validation import field_types, without_optional

__all__ = ["check_new", "commented_yaml", "write_template"]


def write_template(file: Path, scenario: Any, says: str) -> None:
    """Writes a whole scenario with comments, to be edited.

    Args:
        file: the file to write; an existing one is not touched.
        scenario: names its experiment.
        says: a description, which becomes the comment at the top.

    Raises:
        ConfigurationError: the file exists already, or cannot be written.
    """
    says += (
        f"\nSI units. Run it:  geoimp run --scenario {file}\n"
        f"A key that is left out has its default; an unknown one is refused."
    )
    header = "".join(f"# {line}\n" for line in says.splitlines())
    check_new(file)
    write_file(file, header + commented_yaml(scenario))


def check_new(file: Path) -> None:
    """Raises ConfigurationError if `write_template` would."""
    if os.path.lexists(file):
        raise ConfigurationError(f"{file} is there already; give another name, or remove it first.")
    check_file(file)


def commented_yaml(scenario: Any) -> str:
    """Returns a scenario as YAML with a comment at every key whose field has one.

    The comments are those behind or above the fields of the dataclasses.
    """
    return "\n".join(_mapping(type(scenario), plain_data(scenario))) + "\n"


def _mapping(schema: Any, data: dict[str, Any]) -> list[str]:
    """Returns the lines of a mapping, without indentation."""
    types = field_types(schema) or {}
    comments = _comments(schema)
    lines = []
    for key, value in data.items():
        lines += _commented(
            _entry(key, without_optional(types.get(key, Any)), value), comments[key]
        )
    return lines


def _commented(lines: list[str], comment: str) -> list[str]:
    return [f"{lines[0]} # {comment}", *lines[1:]] if comment else lines


def _entry(key: str, schema: Any, value: Any) -> list[str]:
    """Returns the lines of one key, without its comment."""
    if isinstance(value, dict) and value and field_types(schema):
        return [f"{key}:", *_indented(_mapping(schema, value))]
    if isinstance(value, dict) and value and typing.get_origin(schema) is dict:
        nested = dict.fromkeys(value, typing.get_args(schema)[1])
        return [f"{key}:", *_indented(_items(nested, value))]
    if isinstance(value, list) and value and typing.get_origin(schema) is list:
        inner = typing.get_args(schema)[0]
        if field_types(inner):
            return [f"{key}:", *(line for item in value for line in _item(inner, item))]
    return [f"{key}: {_leaf(value)}"]


def _items(schemas: dict[str, Any], data: dict[str, Any]) -> list[str]:
    return [line for key, value in data.items() for line in _entry(key, schemas[key], value)]


def _item(schema: Any, value: dict[str, Any]) -> list[str]:
    first, *rest = _mapping(schema, value)
    return [f"  - {first}", *_indented(_indented(rest))]


def _indented(lines: list[str]) -> list[str]:
    return [f"  {line}" for line in lines]


def _leaf(value: Any) -> str:
    text = yaml.safe_dump(value, default_flow_style=True, width=10_000, allow_unicode=True)
    return text.strip().removesuffix("...").strip()


def _comments(schema: Any) -> defaultdict[str, str]:
    """Returns the comments of a dataclass's fields, its bases' included; none for other schemas."""
    found: defaultdict[str, str] = defaultdict(str)
    for cls in reversed(schema.__mro__):
        if dataclasses.is_dataclass(cls):
            found |= _own_comments(cls)
    return found


def _own_comments(cls: Any) -> dict[str, str]:
    source = textwrap.dedent(inspect.getsource(cls))
    by_line = {
        token.start[0]: token.string.lstrip("# ")
        for token in tokenize.generate_tokens(io.StringIO(source).readline)
        if token.type == tokenize.COMMENT
    }
    lines = source.splitlines()
    definition = ast.parse(source).body[0]
    found = {}
    for node in getattr(definition, "body", []):
        if not isinstance(node, ast.AnnAssign) or not isinstance(node.target, ast.Name):
            continue
        inside = [
            by_line[n]
            for n in range(node.lineno, (node.end_lineno or node.lineno) + 1)
            if n in by_line
        ]
        above = _above(node.lineno - 1, by_line, lines)
        if comment := " ".join(inside or above):
            found[node.target.id] = comment
    return found


def _above(line: int, by_line: dict[int, str], lines: list[str]) -> list[str]:
    """Returns the comments on lines of their own that end at a given line."""
    found: list[str] = []
    while line in by_line and lines[line - 1].lstrip().startswith("#"):
        found.insert(0, by_line[line])
        line -= 1
    return found
