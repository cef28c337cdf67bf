"""Reads, overrides, checks and writes scenarios: YAML through Drake, with readable errors.

A scenario is a plain dataclass whose defaults run. It may contain Drake's own configurations
(`MultibodyPlantConfig`, `SimulatorConfig`) as fields.
"""

import copy
import dataclasses
import re
import typing
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.reading import read_text
from geoimp_drake.scenario.yaml_text import parse_yaml
from geoimp_drake.validation import (
    check,
    check_data,
    field_types,
    quoted,
    unknown_name,
    without_optional,
)

__all__ = [
    "YamlData",
    "dump_scenario",
    "list_index",
    "load_scenario",
    "plain_data",
    "read_layer",
    "read_yaml",
]

Scenario = TypeVar("Scenario")

_DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)  # the first is libyaml's, if it is there


class _Layout(yaml.SafeDumper):
    """Drake's layout of YAML: a line for each key, lists of numbers on one."""


_Layout.add_representer(
    dict,
    lambda dumper, items: dumper.represent_mapping(
        "tag:yaml.org,2002:map", items, flow_style=not items
    ),
)


class YamlData(dict[str, Any]):
    """A mapping that was read from a file, with the places of its keys.

    Attributes:
        file: the one that it was read from.
        lines: line number of each key and entry, by its path.
    """

    file: Path
    lines: dict[str, int]


def load_scenario(
    schema: type[Scenario],
    layers: Sequence[dict[str, Any]] = (),
    overrides: Sequence[str] = (),
) -> Scenario:
    """Makes a scenario from its defaults, then layers of YAML data, then single overrides.

    Args:
        schema: the scenario's dataclass.
        layers: nested dictionaries with the YAML's own keys; later ones win, lists are replaced.
        overrides: `key.path=value` with the value in YAML; a number in the path indexes a list.

    Raises:
        ConfigurationError: a key is unknown (the message lists the valid ones), a value has the
            wrong type, or `validation.check` refuses it.
    """
    try:
        return _loaded(schema, layers, overrides)
    except ConfigurationError as error:
        raise ConfigurationError(f"{_place(error.key, layers, overrides)}{error}") from error


def _loaded(
    schema: type[Scenario], layers: Sequence[dict[str, Any]], overrides: Sequence[str]
) -> Scenario:
    data = plain_data(schema())
    for layer in layers:
        check_data(schema, layer)
        data = _merged(data, layer)
        _complete(schema, data, layer)
    for override in overrides:
        _override(schema, data, override)
    check_data(schema, data)
    _complete(schema, data, _nested(overrides))
    try:
        text = yaml.dump(data, Dumper=_DUMPER)
        scenario = yaml_load_typed(schema=schema, data=text, defaults=schema())
    except (RuntimeError, ValueError, TypeError) as error:
        raise ConfigurationError(f"The scenario cannot be read: {error}") from error
    check(scenario)
    return scenario


def _place(path: str, layers: Sequence[dict[str, Any]], overrides: Sequence[str]) -> str:
    """Returns the file and line of a key, as the beginning of a message; empty for overrides."""
    given = [override.partition("=")[0] for override in overrides]
    if any(f"{path}.".startswith(f"{one}.") for one in given):
        return ""
    files = [layer for layer in layers if isinstance(layer, YamlData) and path in layer.lines]
    return f"{files[-1].file}, line {files[-1].lines[path]}: " if files else ""


def read_yaml(path: Path) -> YamlData:
    """Returns a YAML file's data, without top-level keys that begin with an underscore.

    Such keys serve to hold anchors.

    Raises:
        ConfigurationError: there is no such file, or it is no YAML or no mapping of keys to values.
    """
    lines: dict[str, int] = {}
    data = parse_yaml(read_text(path, "scenario file"), str(path), lines)
    if not isinstance(data, dict):
        raise ConfigurationError(
            f"{path} holds {type(data).__name__ if data is not None else 'nothing'}; a scenario is "
            f"a mapping of keys to values."
        )
    layer = YamlData({key: value for key, value in data.items() if not key.startswith("_")})
    layer.file, layer.lines = path, lines
    return layer


def read_layer(path: Path) -> YamlData:
    """Returns the data of a scenario file; it also finds files beside it that it names.

    Raises:
        ConfigurationError: as `read_yaml`.
    """
    data = read_yaml(path)
    for part in (data.get("robot"), data.get("program")):
        if isinstance(part, dict) and isinstance(part.get("file"), str):
            part["file"] = _beside(path, part["file"])
    robot = data.get("robot")
    if isinstance(robot, dict) and isinstance(robot.get("packages"), dict):
        robot["packages"] = {
            name: _beside(path, str(folder)) for name, folder in robot["packages"].items()
        }
    return data


def _beside(scenario: Path, file: str) -> str:
    """Returns a file's path as it is, or from the scenario's folder if the file is there."""
    beside = scenario.absolute().parent / file
    return str(beside) if beside.exists() else file


def dump_scenario(scenario: Any) -> str:
    """Returns a scenario as YAML; reading it gives the same scenario over any other layers."""
    return str(
        yaml.dump(plain_data(scenario), Dumper=_Layout, default_flow_style=None, sort_keys=False)
    )


def plain_data(scenario: Any) -> dict[str, Any]:
    """Returns a scenario as nested dictionaries, lists, numbers and nulls."""
    data: dict[str, Any] = _with_nulls(
        scenario, parse_yaml(yaml_dump_typed(scenario), "The scenario")
    )
    return data


def _with_nulls(value: Any, data: Any) -> Any:
    """Returns the data of a value with every null: Drake leaves out those of dataclasses."""
    if dataclasses.is_dataclass(value):
        fields = [field.name for field in dataclasses.fields(value)]
        return {name: _with_nulls(getattr(value, name), data.get(name)) for name in fields}
    if isinstance(value, list):
        return [_with_nulls(*pair) for pair in zip(value, data, strict=True)]
    if isinstance(value, dict):
        return {key: _with_nulls(value[key], inner) for key, inner in data.items()}
    return data


def _merged(base: Any, top: Any) -> Any:
    if isinstance(base, dict) and isinstance(top, dict):
        return {key: _merged(base.get(key), top.get(key, base.get(key))) for key in {**base, **top}}
    return copy.deepcopy(top)  # an override is written into it


def _complete(schema: Any, data: Any, given: Any) -> None:
    """Lets each dataclass with a `complete_data(data, given)` derive further data from a layer."""
    schema = without_optional(schema)
    if not (isinstance(data, dict) and isinstance(given, dict)):
        return
    for name, kind in (field_types(schema) or {}).items():
        _complete(kind, data.get(name), given.get(name))
    if hasattr(schema, "complete_data"):
        schema.complete_data(data, given)


def _nested(overrides: Sequence[str]) -> dict[str, Any]:
    """Returns the keys that overrides give, in the form of a layer; without keys within lists."""
    layer: dict[str, Any] = {}
    for override in overrides:
        path, _, text = override.partition("=")
        value = parse_yaml(text, f"The value of {quoted(override)}")
        for name in reversed(path.split(".")):
            value = {name: value}
        layer = _merged(layer, value)
    return layer


def _override(schema: Any, data: dict[str, Any], override: str) -> None:
    """Sets one value in place, from `key.path=value`."""
    path, equals, text = override.partition("=")
    if not equals or not path:
        raise ConfigurationError(f"{quoted(override)} is not of the form key.path=value.")
    value = parse_yaml(text, f"The value of {quoted(override)}")
    target: Any = data
    keys = path.split(".")
    for depth, key in enumerate(keys):
        schema, index = _step(schema, target, key, ".".join(keys[:depth]))
        if depth == len(keys) - 1:
            target[index] = value
            continue
        if isinstance(target, dict) and target.get(index) is None:
            target[index] = {}
        target = target[index]


def list_index(key: str, target: list[Any]) -> int | None:
    """Returns the index that a part of a key's path gives in a list; None if it gives none."""
    is_index = re.fullmatch(r"[0-9]{1,9}", key) and int(key) < len(target)
    return int(key) if is_index else None


def _step(schema: Any, target: Any, key: str, path: str) -> tuple[Any, Any]:
    """Returns the schema of a part and its index in `target`; raises if there is no such part."""
    schema = without_optional(schema)
    fields = field_types(schema)
    if isinstance(target, list):
        if (index := list_index(key, target)) is None:
            raise ConfigurationError(
                f"{path} has {len(target)} entries; {quoted(key)} is none of them."
            )
        return (typing.get_args(schema) or (Any,))[0], index
    if not isinstance(target, dict):
        raise ConfigurationError(f"{path} is {quoted(target)}; {quoted(key)} is no part of that.")
    if typing.get_origin(schema) is dict:
        return typing.get_args(schema)[1], key
    if fields is None:
        raise ConfigurationError(f"{path} has no parts; {quoted(key)} is none of them.")
    if key not in fields:
        raise unknown_name(key, f"key in {path or 'the scenario'}", fields)
    return fields[key], key
