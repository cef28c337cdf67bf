"""The public names with their signatures, and the keys of scenarios, one line each.

`python tests/helpers/public_names.py` records them for tests/project/test_public_names.py.
"""

import dataclasses
import importlib
import inspect
import re
import types
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from library_tree import MODULES, ROOT

RECORD = ROOT / "tests" / "project" / "public_names.txt"
_PAGE = ROOT / "docs" / "api" / "index.md"


def public_modules() -> list[str]:
    """The modules that docs/api/index.md names, and those within the packages that it names."""
    section = _PAGE.read_text(encoding="utf-8").partition("## What is public")[2]
    listed = re.findall(r"`(geoimp_drake(?:\.\w+)*)`", section.partition("```")[0])
    # The package itself stands for `geoimp_drake.__all__`, not for all within it.
    within = tuple(f"{name}." for name in listed if name != "geoimp_drake")
    return sorted(
        name
        for name in MODULES
        if (name in listed or name.startswith(within)) and ".compositions" not in name
    )


def _signature(thing: Any) -> str:
    try:
        parameters = inspect.signature(thing).parameters.values()
    except (TypeError, ValueError):
        return ""
    names = [f"{p}".partition(":")[0].partition("=")[0].strip() for p in parameters]
    ends = ["=…" if p.default is not p.empty else "" for p in parameters]
    kinds = [p.kind for p in parameters]
    shown = [name + end for name, end in zip(names, ends, strict=True)]
    if inspect.Parameter.KEYWORD_ONLY in kinds and inspect.Parameter.VAR_POSITIONAL not in kinds:
        shown.insert(kinds.index(inspect.Parameter.KEYWORD_ONLY), "*")
    return f"({', '.join(shown)})"


def _members(thing: type) -> Iterator[str]:
    """The methods and properties that a class of ours defines."""
    for name, member in sorted(vars(thing).items()):
        if name.startswith("_"):
            continue
        if isinstance(member, property):
            yield name
        elif isinstance(member, types.FunctionType | classmethod | staticmethod):
            yield name + _signature(getattr(thing, name))


def _names() -> Iterator[str]:
    for module in public_modules():
        imported = importlib.import_module(module)
        for name in sorted(getattr(imported, "__all__", ())):
            thing = getattr(imported, name)
            path = f"{module}.{name}"
            # numba's and our own wrappers carry the law itself.
            yield path + (_signature(thing) if callable(thing) else "")
            if inspect.isclass(thing) and thing.__module__ == module:
                yield from (f"{path}.{member}" for member in _members(thing))


def _keys(schema: Any, prefix: str) -> Iterator[str]:
    """The keys of a configuration, nested ones too."""
    for part in (schema, *typing.get_args(schema)):
        if dataclasses.is_dataclass(part):
            hints = typing.get_type_hints(part)
            for field in dataclasses.fields(part):
                yield f"{prefix}{field.name}"
                yield from _keys(hints[field.name], f"{prefix}{field.name}.")


def _scenario_keys() -> Iterator[str]:
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment

    schemas = {type(get_experiment(name).scenario()) for name in ("plexiglas", "bar")}
    schemas.add(type(get_experiment("peg_in_hole").scenario()))
    for schema in sorted(schemas, key=lambda schema: schema.__name__):
        yield from dict.fromkeys(_keys(schema, f"{schema.__name__}: "))


def public_names() -> list[str]:
    """The lines, as they are recorded."""
    return [*_names(), *_scenario_keys()]


if __name__ == "__main__":
    Path(RECORD).write_text("".join(f"{line}\n" for line in public_names()), encoding="utf-8")
