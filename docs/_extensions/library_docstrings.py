"""The library's docstrings, written to be read in the source, as reStructuredText.

They differ in three things: a block is set off by its indentation or by a Markdown fence, single
backticks mean code, and ports are listed one a line. Fields of a dataclass are described beside
them, in comments; here they become a section, with the defaults that they really have.
"""

import ast
import dataclasses
import inspect
import re
import textwrap
from collections.abc import Iterator
from itertools import groupby
from typing import Any

import numpy as np
from sphinx.application import Sphinx

_SECTION = re.compile(r"(Args|Attributes|Ports|Raises|Returns|Yields):$")
_PORT = re.compile(r"( +)(input|output) (\w+): (.*)$")
_BEFORE_NAPOLEON = 400


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the conversion."""
    app.setup_extension("sphinx.ext.autodoc")
    app.connect("autodoc-process-docstring", _convert, priority=_BEFORE_NAPOLEON)
    return {"parallel_read_safe": True}


def _convert(
    app: Sphinx, what: str, name: str, target: Any, options: Any, lines: list[str]
) -> None:
    """Rewrites the lines of a docstring in place."""
    end = next((k for k, line in enumerate(lines) if _SECTION.match(line)), len(lines))
    prose, sections = _prose(lines[:end]), list(_sections(lines[end:]))
    if what == "class" and dataclasses.is_dataclass(target) and "Attributes:" not in lines:
        prose += _fields(target)
    lines[:] = [*prose, "", *sections]


def _prose(lines: list[str]) -> list[str]:
    """Returns text with its fenced and its indented parts as literal blocks."""
    converted: list[str] = []
    parts = re.split(r"^```$", "\n".join(lines), flags=re.MULTILINE)
    for k, part in enumerate(parts):
        if k % 2:  # within a fence
            converted += ["", "::", "", *textwrap.indent(part, "    ").splitlines(), ""]
        else:
            converted += _indented_as_literal(part.splitlines())
    return converted


def _indented_as_literal(lines: list[str]) -> Iterator[str]:
    for indented, group in groupby(lines, key=lambda line: line.startswith("    ")):
        if indented:
            yield from ("", "::", "", *group, "")
        else:
            yield from map(_escaped, group)


def _sections(lines: list[str]) -> Iterator[str]:
    """Yields the sections of a docstring with its ports as lists."""
    in_port = False
    for line in lines:
        port = _PORT.match(line)
        if port:
            indent, direction, name, text = port.groups()
            if not in_port:
                yield ""
            yield f"{indent}* {direction} ``{name}``: {_escaped(text)}"
        else:
            continued = in_port and line.strip() and not _SECTION.match(line)
            yield _escaped(re.sub(r"^( +)  (?=\S)", r"\1", line) if continued else line)
        in_port = bool(port) or (in_port and bool(line.strip()))


def _escaped(line: str) -> str:
    """Returns a line in which |x| is an absolute value and no substitution."""
    return line.replace("|", r"\|")


def _fields(cls: type) -> list[str]:
    """Returns a section with name, default and comment of each field of a dataclass."""
    described = list(_described_fields(cls))
    return ["", "Fields:", *(f"    * {text}" for text in described)] if described else []


def _described_fields(cls: type) -> Iterator[str]:
    source = textwrap.dedent(inspect.getsource(cls)).splitlines()
    (node,) = ast.parse("\n".join(source)).body
    assert isinstance(node, ast.ClassDef)
    for item in node.body:
        if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name):
            last = item.end_lineno or item.lineno
            comment = _comment_above(source, item.lineno) + _comment_in(source, last)
            default = _default(cls, item.target.id)
            text = f"``{item.target.id}``" + (f" = ``{default}``" if default else "")
            yield text + (f": {_escaped(comment)}" if comment else "")


def _comment_in(source: list[str], number: int) -> str:
    """Returns the comment at the end of a line, which is counted from one."""
    _, _, comment = source[number - 1].partition("  # ")
    return comment.strip()


def _comment_above(source: list[str], number: int) -> str:
    lines = []
    for line in reversed(source[: number - 1]):
        if not line.strip().startswith("# "):
            break
        lines.insert(0, line.strip().removeprefix("# "))
    return " ".join(lines)


def _default(cls: type, name: str) -> str:
    """Returns the default of a field as one would write it, or its type if it has parts."""
    field = next(field for field in dataclasses.fields(cls) if field.name == name)
    if field.default is not dataclasses.MISSING:
        value = field.default
    elif field.default_factory is not dataclasses.MISSING:
        value = field.default_factory()
    else:
        return ""
    if isinstance(value, np.ndarray):
        return str(value.tolist())
    plain = isinstance(value, int | float | str | list | tuple | dict | None)
    return repr(value) if plain else type(value).__name__
