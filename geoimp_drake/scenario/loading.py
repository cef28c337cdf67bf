"""Reading, overriding, checking and writing scenarios: YAML through Drake, errors for people.

A scenario is a plain dataclass whose defaults run. It may contain Drake's own configurations
(`MultibodyPlantConfig`, `SimulatorConfig`) as fields.
"""

import typing
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.reading import read_text
from geoimp_drake.scenario.yaml_text import YamlData, parse_yaml
from geoimp_drake.validation import (
    check,
    check_data,
    field_types,
    quoted,
    unknown_name,
    without_optional,
)

__all__ = [
    "dump_scenario",
    "load_scenario",
    "plain_data",
    "read_layer",
    "read_yaml",
]

Scenario = TypeVar("Scenario")


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
        ConfigurationError: an unknown key (the valid ones listed), a value of the wrong type, or
            whatever `validation.check` refuses.
    """
    data = plain_data(schema())
    for layer in layers:
        check_data(schema, layer)
        data = _merged(data, layer)
    for override in overrides:
        _override(schema, data, override)
    check_data(schema, data)
    try:
        scenario = yaml_load_typed(schema=schema, data=yaml.safe_dump(data), defaults=schema())
    except (RuntimeError, ValueError, TypeError) as error:
        raise ConfigurationError(f"The scenario cannot be read: {error}") from error
    check(scenario)
    return scenario


def read_yaml(path: Path) -> YamlData:
    """Returns a YAML file's data.

    Raises:
        ConfigurationError: no such file, no YAML, or not a mapping of keys to values.
    """
    data = parse_yaml(read_text(path, "scenario file"), str(path))
    if not isinstance(data, YamlData):
        raise ConfigurationError(
            f"{path} holds {type(data).__name__ if data is not None else 'nothing'}; a scenario is "
            f"a mapping of keys to values."
        )
    return data


def read_layer(path: Path) -> YamlData:
    """Returns the data of a scenario file; files that it names are looked for beside it, too.

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
    """Returns a scenario as YAML; reading it gives the same scenario."""
    return str(yaml_dump_typed(scenario))


def plain_data(scenario: Any) -> dict[str, Any]:
    """Returns a scenario as nested dictionaries, lists and numbers."""
    return dict(yaml.safe_load(dump_scenario(scenario)))


def _merged(base: Any, top: Any) -> Any:
    if isinstance(base, dict) and isinstance(top, dict):
        return {key: _merged(base.get(key), top.get(key, base.get(key))) for key in {**base, **top}}
    return top


def _override(schema: Any, data: dict[str, Any], override: str) -> None:
    """Sets one value in place, from `key.path=value`."""
    path, equals, text = override.partition("=")
    if not equals or not path:
        raise ConfigurationError(f"{quoted(override)} is not of the form key.path=value.")
    value = parse_yaml(text, f"The value of {quoted(override)}")
    value = dict(value) if isinstance(value, dict) else value  # as what it is put into
    target: Any = data
    keys = path.split(".")
    for depth, key in enumerate(keys):
        schema, index = _step(schema, target, key, ".".join(keys[:depth]))
        if depth == len(keys) - 1:
            target[index] = value
        elif isinstance(target, dict) and target.get(index) is None:
            target = target.setdefault(index, {})
        else:
            target = target[index]


def _step(schema: Any, target: Any, key: str, path: str) -> tuple[Any, Any]:
    """Returns the schema of a part and its index in `target`; raises if there is no such part."""
    schema = without_optional(schema)
    fields = field_types(schema)
    if isinstance(target, list):
        if not key.isdigit() or int(key) >= len(target):
            raise ConfigurationError(f"{path} has {len(target)} entries; '{key}' is none of them.")
        return (typing.get_args(schema) or (Any,))[0], int(key)
    if typing.get_origin(schema) is dict:
        return typing.get_args(schema)[1], key
    if fields is None:
        raise ConfigurationError(f"'{path}' has no parts, so '{path}.{key}' does not exist.")
    if key not in fields:
        raise unknown_name(key, f"key in {path or 'the scenario'}", fields)
    return fields[key], key
