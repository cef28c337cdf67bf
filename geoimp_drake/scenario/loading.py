"""Reading, overriding, checking and writing scenarios: YAML through Drake, errors for people.

A scenario is a plain dataclass whose defaults run. It may contain Drake's own configurations
(`MultibodyPlantConfig`, `SimulatorConfig`) as fields.
"""

import dataclasses
import types
import typing
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import yaml
from pydrake.common.yaml import yaml_dump_typed, yaml_load, yaml_load_typed

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.validation import unknown_name

__all__ = [
    "check_keys",
    "dump_scenario",
    "field_types",
    "load_scenario",
    "plain_data",
    "read_layer",
    "read_yaml",
    "without_optional",
]

Scenario = TypeVar("Scenario")


def load_scenario(
    schema: type[Scenario],
    layers: Sequence[dict[str, Any]] = (),
    overrides: Sequence[str] = (),
) -> Scenario:
    """Makes a scenario from its defaults, then layers of YAML data, then single overrides.

    Args:
        schema: the scenario's dataclass, with a `validate()`.
        layers: nested dictionaries with the YAML's own keys; later ones win, lists are replaced.
        overrides: `key.path=value` with the value in YAML; a number in the path indexes a list.

    Raises:
        ConfigurationError: an unknown key (the valid ones listed), a value of the wrong type, or
            whatever `validate()` refuses.
    """
    data = plain_data(schema())
    for layer in layers:
        check_keys(schema, layer, "")
        data = _merged(data, layer)
    for override in overrides:
        _override(schema, data, override)
    check_keys(schema, data, "")
    try:
        scenario = yaml_load_typed(schema=schema, data=yaml.safe_dump(data), defaults=schema())
    except (RuntimeError, ValueError, TypeError) as error:
        raise ConfigurationError(f"The scenario cannot be read: {error}") from error
    scenario.validate()
    return scenario


def read_yaml(path: Path) -> dict[str, Any]:
    """Returns a YAML file's data.

    Raises:
        ConfigurationError: no such file, no YAML, or not a mapping of keys to values.
    """
    try:
        data = yaml_load(filename=str(path))
    except (OSError, RuntimeError, UnicodeDecodeError) as error:
        raise ConfigurationError(f"The scenario file {path} cannot be read: {error}") from error
    except yaml.YAMLError as error:
        raise ConfigurationError(f"{path} is not YAML: {' '.join(str(error).split())}") from error
    if not isinstance(data, dict):
        raise ConfigurationError(
            f"{path} holds {type(data).__name__ if data is not None else 'nothing'}; a scenario is "
            f"a mapping of keys to values."
        )
    return data


def read_layer(path: Path) -> dict[str, Any]:
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


def check_keys(schema: Any, data: Any, path: str) -> None:
    """Raises ConfigurationError where data does not fit a schema; the message names the key."""
    if data is None and without_optional(schema) is not schema:
        return
    schema = without_optional(schema)
    fields = field_types(schema)
    if fields is not None:
        if not isinstance(data, dict):
            raise ConfigurationError(f"{path or 'The scenario'} must be a mapping, not {data!r}.")
        for key, value in data.items():
            where = f"{path}.{key}" if path else str(key)
            if key not in fields:
                raise unknown_name(str(key), f"key in {path or 'the scenario'}", fields)
            check_keys(fields[key], value, where)
    elif typing.get_origin(schema) is list:
        if not isinstance(data, list):
            raise ConfigurationError(f"{path} must be a list, not {data!r}.")
        for index, value in enumerate(data):
            check_keys(typing.get_args(schema)[0], value, f"{path}.{index}")
    elif typing.get_origin(schema) is dict:
        if not isinstance(data, dict):
            raise ConfigurationError(f"{path} must be a mapping, not {data!r}.")
        for key, value in data.items():
            check_keys(typing.get_args(schema)[1], value, f"{path}.{key}")
    elif data is not None:
        _check_leaf(schema, data, path)


def _check_leaf(schema: Any, value: Any, path: str) -> None:
    kind = {float: "a number", int: "a whole number", str: "a text", bool: "true or false"}
    if schema is bool and not isinstance(value, bool):
        raise ConfigurationError(f"{path} is {value!r}; give true or false.")
    if schema is str:
        if isinstance(value, dict | list):
            raise ConfigurationError(f"{path} is {value!r}; give a text.")
        return
    try:
        if schema in (float, int):
            if schema(value) != float(value) and not np.isnan(float(value)):
                raise ValueError
        elif schema is not bool:
            np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        wanted = kind.get(schema, "numbers in lists of equal length")
        raise ConfigurationError(f"{path} is {value!r}; give {wanted}.") from None


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


def _merged(base: Any, top: Any) -> Any:
    if isinstance(base, dict) and isinstance(top, dict):
        return {key: _merged(base.get(key), top.get(key, base.get(key))) for key in {**base, **top}}
    return top


def _override(schema: Any, data: dict[str, Any], override: str) -> None:
    """Sets one value in place, from `key.path=value`."""
    path, equals, text = override.partition("=")
    if not equals or not path:
        raise ConfigurationError(f"'{override}' is not of the form key.path=value.")
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ConfigurationError(
            f"The value of '{override}' is not YAML: {' '.join(str(error).split())}"
        ) from error
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
