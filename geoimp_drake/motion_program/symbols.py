"""Names of a PDL 2 program: their declarations and their values."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.math import RigidTransform

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.typing import Array
from geoimp_drake.validation import LARGEST, finite_vector, quoted, unknown_name

if TYPE_CHECKING:
    from lark import Token

__all__ = ["Symbol", "SymbolTable"]

_WHAT_IS = {
    "CONST": "a constant",
    "JOINTPOS": "a JOINTPOS",
    "POSITION": "a POSITION",
    "INTEGER": "an INTEGER",
    "REAL": "a REAL",
}


@dataclass
class Symbol:
    """A constant or a variable of a program."""

    token: "Token"  # its name where it is declared
    kind: str  # CONST or the variable's type
    value: Any = None  # None until it is taught
    given: bool = False  # by the caller
    used: bool = False


class SymbolTable:
    """The names that a program declares; they do not depend on case.

    Args:
        file: that of the program, for errors.
    """

    def __init__(self, file: str):
        self.file = file
        self._symbols: dict[str, Symbol] = {}

    def error(self, token: "Token", message: str) -> ConfigurationError:
        """Returns an error at a place in the program."""
        return ConfigurationError(
            f"{self.file}, line {token.line}, column {token.column}: {message}."
        )

    def declare(self, symbol: Symbol) -> None:
        """Adds a name; raises ConfigurationError if it is declared already."""
        before = self._symbols.get(symbol.token.casefold())
        if before is not None:
            raise self.error(
                symbol.token,
                f"'{symbol.token}' is declared already, in line {before.token.line}",
            )
        self._symbols[symbol.token.casefold()] = symbol

    def override_constants(self, values: Mapping[str, float]) -> None:
        """Gives constants other values; raises ConfigurationError for a name of no constant."""
        constants = self._of_kinds("CONST")
        for name, value in values.items():
            symbol = self._declared(name, "constant", constants)
            symbol.value = _number(value, f"The constant '{name}' of {self.file}")
            symbol.given = True

    def teach(self, values: Mapping[str, Array | RigidTransform | float]) -> None:
        """Gives variables their values; raises ConfigurationError for a wrong name or kind."""
        variables = {key: symbol for key, symbol in self._symbols.items() if symbol.kind != "CONST"}
        for name, value in values.items():
            symbol = self._declared(name, "taught variable", variables)
            symbol.value = _taught(value, symbol.kind, f"The taught '{name}' of {self.file}")
            symbol.given = True

    def value_of(self, token: "Token", use: str, *kinds: str) -> Any:
        """Returns the value of a name that a statement uses.

        Raises:
            ConfigurationError: the name is not declared, of another kind, or not taught.
        """
        symbol = self._symbols.get(token.casefold())
        if symbol is None:
            declared = ", ".join(
                f"{s.token} ({_WHAT_IS[s.kind].split()[-1]})" for s in self._symbols.values()
            )
            raise self.error(
                token, f"'{token}' is not declared; the program declares {declared or 'nothing'}"
            )
        if symbol.kind not in kinds:
            wanted = " or ".join(_WHAT_IS[kind] for kind in kinds)
            raise self.error(token, f"'{token}' is {_WHAT_IS[symbol.kind]}; {use} takes {wanted}")
        if symbol.value is None:
            raise self.error(token, f"'{token}' is not taught; give its value")
        symbol.used = True
        return symbol.value

    def check_all_used(self) -> None:
        """Raises ConfigurationError if the caller gave a value that no statement uses."""
        idle = [str(s.token) for s in self._symbols.values() if s.given and not s.used]
        if idle:
            raise ConfigurationError(
                f"{self.file}: no statement uses {', '.join(idle)}, whose value is given. Leave it "
                f"out or correct the program."
            )

    def _of_kinds(self, kind: str) -> dict[str, Symbol]:
        return {key: symbol for key, symbol in self._symbols.items() if symbol.kind == kind}

    def _declared(self, name: str, what: str, symbols: Mapping[str, Symbol]) -> Symbol:
        if name.casefold() not in symbols:
            names = [str(symbol.token) for symbol in symbols.values()]
            raise unknown_name(name, f"{what} of {self.file}", names)
        return symbols[name.casefold()]


def _taught(value: Any, kind: str, name: str) -> Any:
    """Returns a taught value; raises ConfigurationError unless it is of the variable's type."""
    if kind == "POSITION":
        if not isinstance(value, RigidTransform):
            raise ConfigurationError(f"{name} is a POSITION; give a pose (RigidTransform).")
        return value
    if kind == "JOINTPOS":
        if np.ndim(value) != 1:
            raise ConfigurationError(f"{name} is a JOINTPOS; give one number a joint [rad or m].")
        return finite_vector(value, name, np.size(value))
    number = _number(value, name)
    if kind == "INTEGER" and number != round(number):
        raise ConfigurationError(f"{name} is an INTEGER, not {number:g}.")
    return number


def _number(value: Any, name: str) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = float("nan")
    if not abs(number) <= LARGEST:
        raise ConfigurationError(
            f"{name} is {quoted(value)}; give a finite number of at most {LARGEST:g} in size."
        )
    return number
