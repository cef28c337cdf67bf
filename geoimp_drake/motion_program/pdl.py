"""Reads motion programs in a subset of PDL 2, the Pascal-like language of an industrial robot.

```
PROGRAM name
CONST name = number …
VAR name, name : JOINTPOS | POSITION | INTEGER | REAL [FOR ARM[number]] …
BEGIN
  MOVE TO joint_position
  MOVE LINEAR TO position
  MOVE RELATIVE VEC(x, y, z) IN TOOL   -- millimetres
  $ARM_OVR := value                    -- per cent, speeds and accelerations of the moves after it
END name
```

A value is a number, a constant or an INTEGER or REAL variable, with or without a sign. Keywords and
names do not depend on case; `--` starts a comment. Variables are taught: their values come from the
caller, in SI units as everywhere in this library.
"""

import contextlib
import functools
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.math import RigidTransform

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.extras import needs_extra
from geoimp_drake.motion_program.program import (
    JointMove,
    LinearMove,
    MotionProgram,
    SpeedOverride,
    Step,
    ToolMove,
)
from geoimp_drake.motion_program.symbols import Symbol, SymbolTable
from geoimp_drake.reading import read_text
from geoimp_drake.typing import Array
from geoimp_drake.validation import quoted

if TYPE_CHECKING:
    from lark import Lark, Token, Tree
    from lark.exceptions import UnexpectedInput

__all__ = ["parse_program", "read_program"]

_GRAMMAR = Path(__file__).with_name("pdl.lark")
_MILLIMETRE = 1e-3  # [m]
_TERMINALS = {
    "NAME": "a name",
    "NUMBER": "a number",
    "SIGN": "a sign",
    "KIND": "a type (JOINTPOS, POSITION, INTEGER, REAL)",
    "SYSTEM_VARIABLE": "$ARM_OVR",
    "$END": "the end of the program",
}


def read_program(
    path: str | Path,
    taught: Mapping[str, Array | RigidTransform | float],
    constants: Mapping[str, float] | None = None,
) -> MotionProgram:
    """Reads a program from a file.

    Args:
        path: of the file, UTF-8, with or without a byte order mark.
        taught: values of the variables. A JOINTPOS has joint positions from the base to the hand
            [rad or m], a POSITION the pose X_WT of the tool frame. Others have a number.
        constants: values that replace those of the program, by name.

    Raises:
        ConfigurationError: the file cannot be read or is no such program, or a variable that it
            needs is not taught. The message has file, line and column.
    """
    text = read_text(Path(path), "motion program")
    return parse_program(text, taught, constants, file=Path(path).name)


def parse_program(
    text: str,
    taught: Mapping[str, Array | RigidTransform | float],
    constants: Mapping[str, float] | None = None,
    file: str = "program",
) -> MotionProgram:
    """Reads a program from its text; `file` names it in errors. Otherwise as `read_program`."""
    tree = _parse(text, file)
    table = SymbolTable(file)
    for section in tree.find_data("constants"):
        for constant in _children(section):
            _declare_constant(table, constant)
    for section in tree.find_data("variables"):
        for declaration in _children(section):
            _declare_variables(table, declaration)
    table.override_constants(constants or {})
    table.teach(taught)

    name, *parts, end = _children(tree)
    steps = [
        _step(table, part, text) for part in parts if part.data not in ("constants", "variables")
    ]
    if end.casefold() != name.casefold():
        raise table.error(end, f"program '{name}' ends with 'END {end}'; write 'END {name}'")
    table.check_all_used()
    return MotionProgram(steps, str(name))


@functools.cache
def _parser() -> "Lark":
    with needs_extra("pdl", "A program in PDL 2"):
        from lark import Lark
    # The basic lexer does not mistake keywords for names.
    return Lark(
        _GRAMMAR.read_text(encoding="utf-8"),
        start="program",
        parser="lalr",
        lexer="basic",
        propagate_positions=True,
    )


def _parse(text: str, file: str) -> "Tree":
    parser = _parser()
    from lark.exceptions import UnexpectedInput

    try:
        return parser.parse(text)
    except UnexpectedInput as error:
        raise ConfigurationError(_syntax_message(parser, error, text, file)) from None


def _syntax_message(parser: "Lark", error: "UnexpectedInput", text: str, file: str) -> str:
    """Returns where the text stops being a program, what it finds there and what it expects."""
    from lark.exceptions import UnexpectedToken

    line, column = error.line, error.column
    if not isinstance(error, UnexpectedToken):
        found = f"'{text[error.pos_in_stream or 0]}'"
    elif error.token.type == "$END":
        found, line, column = "the end of the text", error.token.end_line, error.token.end_column
    else:
        found = quoted(str(error.token))
    names = {terminal.name: terminal for terminal in parser.terminals}
    expected = sorted(
        _TERMINALS.get(name) or f"'{names[name].pattern.value}'" for name in _accepted(parser, text)
    )
    return f"{file}, line {line}, column {column}: expected {' or '.join(expected)}, found {found}."


def _accepted(parser: "Lark", text: str) -> set[str]:
    """Returns the terminals that are possible where the text stops being a program."""
    from lark.exceptions import UnexpectedInput

    state: Any = parser.parse_interactive(text)
    with contextlib.suppress(UnexpectedInput):
        state.exhaust_lexer()
    return set(state.accepts())


def _children(tree: "Tree") -> list[Any]:
    """Returns a tree's children: tokens or trees, as the grammar says."""
    return list(tree.children)


def _declare_constant(table: SymbolTable, constant: "Tree") -> None:
    name, *value = _children(constant)
    table.declare(Symbol(name, "CONST", float("".join(value))))


def _declare_variables(table: SymbolTable, declaration: "Tree") -> None:
    tokens = _children(declaration)
    kind = next(token for token in tokens if token.type == "KIND")
    for token in tokens:
        if token.type == "NAME":
            table.declare(Symbol(token, kind.upper()))
        elif token.type == "NUMBER" and token != "1":
            raise table.error(token, f"ARM[{token}]: a program moves one arm, ARM[1]")


def _step(table: SymbolTable, statement: "Tree", text: str) -> Step:
    """Returns the step that a statement describes."""
    meta = statement.meta
    name = " ".join(text[meta.start_pos : meta.end_pos].split())
    place = f"{table.file}, line {meta.line}"
    children = _children(statement)
    if statement.data == "joint_move":
        return JointMove(table.value_of(children[0], "MOVE TO", "JOINTPOS"), name, place)
    if statement.data == "linear_move":
        return LinearMove(table.value_of(children[0], "MOVE LINEAR TO", "POSITION"), name, place)
    if statement.data == "tool_move":
        displacement = np.array([_number(table, term, "VEC") for term in children])
        return ToolMove(_MILLIMETRE * displacement, name, place)
    return _override(table, children[0], children[1], place)


def _override(table: SymbolTable, variable: "Token", term: "Tree", place: str) -> SpeedOverride:
    if variable.upper() != "$ARM_OVR":
        raise table.error(
            variable, f"unknown system variable '{variable}'; the only one is $ARM_OVR"
        )
    percent = _number(table, term, "$ARM_OVR")
    if not 1 <= percent <= 100:
        raise table.error(
            _children(term)[-1], f"the speed override is {percent:g} %; give one from 1 to 100"
        )
    return SpeedOverride(percent, place)


def _number(table: SymbolTable, term: "Tree", use: str) -> float:
    """Returns the value of a number, a constant or a numeric variable with its sign."""
    *signs, token = _children(term)
    if token.type == "NUMBER":
        value = float(token)
    else:
        value = float(table.value_of(token, use, "CONST", "INTEGER", "REAL"))
    return -value if "-" in signs else value
