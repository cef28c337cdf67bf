"""Every field of every scenario: what cannot be used is refused by the very key in the YAML."""

import copy
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.supervisor import SupervisorLimits
from geoimp_drake.validation import check, field_types

TASK = {
    "kind": "weighted-sum",
    "terms": [{"kind": "joint-target", "joints": ["elbow"], "target": [1.0], "initial": [0.9]}],
}
REDUNDANCY = {"task": TASK, "weight": "matrix", "weight_matrix": [1.0] * 7}
AXES = np.eye(3).tolist()
IMPEDANCE = {
    "coupling": np.zeros((3, 3)).tolist(),
    "translation": {"stiffness": [1.0, 2.0, 3.0], "principal_axes": AXES},
    "rotation": {"stiffness": [1.0, 2.0, 3.0], "principal_axes": AXES},
}
RAMP = {"force": [1.0, 0.0, 0.0]}
# What an experiment leaves out is added, so that each scenario has one of everything.
SCENARIOS = {
    "redundancy": {
        "duration": 1.0,
        "robot": {"file": "arm.urdf", "end_effector": "hand", "sensor_joint": "wrist"},
        "start": {"posture": [0.0] * 7},
        "external": RAMP,
        "redundancy": REDUNDANCY,
        "impedance": IMPEDANCE,
    },
    "peg_in_hole": {
        "duration": 1.0,
        "speeds": {
            name: [1.0] * 7 for name in ("joint_speeds", "joint_accelerations", "joint_weights")
        },
        "servo": {"kp": [1.0] * 7},
        "external": RAMP,
        "redundancy": REDUNDANCY,
        "impedance": IMPEDANCE,
        "seven": {
            "hold": {"posture": [0.0] * 7},
            "taught": [
                {"name": "rest", "joints": [0.0] * 7},
                {"name": "up", "position": [0.0] * 3},
            ],
        },
    },
    "bar": {
        "duration": 1.0,
        "load": {"mass": 4.0},
        "mutual_pose": {"position": [0.0, 1.0, 0.0]},
        "redundancy_1": REDUNDANCY,
        "redundancy_2": REDUNDANCY,
        "impedance": IMPEDANCE,
    },
}
# Texts that name what the user likes, or what is in a file; "x" may be one.
FREE_TEXTS = {
    *("experiment", "name", "arm", "joints", "link", "file", "end_effector", "sensor_joint"),
    *("path_constant", "address", "url"),
}
LIMITS = {f"robot.driver.supervisor.limits.{name}" for name in vars(SupervisorLimits())}
UNBOUNDED = {"sensor.force_range", "sensor.moment_range"} | LIMITS


def leaves(value: Any, path: str = "", way: tuple[Any, ...] = ()) -> Iterator[tuple[str, tuple]]:
    """Yields path and way (attributes, indices and keys) of all that has no parts."""
    if (fields := field_types(type(value))) is not None:
        parts = {name: getattr(value, name) for name in fields}
    elif isinstance(value, dict):
        parts = value
    elif isinstance(value, list):
        parts = dict(enumerate(value))
    else:
        yield path, way
        return
    for name, part in parts.items():
        yield from leaves(part, f"{path}.{name}".strip("."), (*way, name))


def scenario(experiment: str) -> Any:
    return get_experiment(experiment).scenario((SCENARIOS[experiment],))


def part_at(whole: Any, way: tuple[Any, ...]) -> Any:
    for name in way:
        whole = whole[name] if isinstance(whole, dict | list) else getattr(whole, name)
    return whole


def with_value(whole: Any, way: tuple[Any, ...], value: Any) -> Any:
    changed = copy.deepcopy(whole)
    holder = part_at(changed, way[:-1])
    if isinstance(holder, dict | list):
        holder[way[-1]] = value
    else:
        setattr(holder, way[-1], value)
    return changed


def said_of(whole: Any, way: tuple[Any, ...], value: Any) -> str:
    """Returns what the check says of a scenario with one value changed; nothing if it is taken."""
    try:
        check(with_value(whole, way, value))
    except ConfigurationError as error:
        return str(error)
    return ""


def bad_values(path: str, value: Any) -> list[tuple[Any, str]]:
    """Returns what a leaf must not be, and how the error then begins."""
    if isinstance(value, str):
        free = FREE_TEXTS & set(path.split("."))
        return [] if free else [("x", f"Unknown {path} 'x'.")]
    if value is None or isinstance(value, bool | int):
        return []
    bad = [np.nan] if path in UNBOUNDED else [np.nan, np.inf]
    return [(np.multiply(np.ones_like(value), number)[()], f"{path} is ") for number in bad]


@pytest.mark.parametrize("experiment", SCENARIOS)
def test_what_is_not_finite_or_no_known_name_is_refused_by_its_key(experiment: str) -> None:
    whole = scenario(experiment)
    check(whole)
    tried, wrong = 0, {}
    for path, way in leaves(whole):
        for value, beginning in bad_values(path, part_at(whole, way)):
            tried += 1
            said = said_of(whole, way, value)
            if not said.startswith(beginning):
                wrong[path] = said
    assert tried > 100
    assert wrong == {}


@pytest.mark.parametrize("experiment", SCENARIOS)
def test_a_value_of_another_type_is_refused_by_its_key(experiment: str) -> None:
    """Drake's own configurations refuse other types themselves, as they are set."""
    whole = scenario(experiment)
    wrong = {}
    for path, way in leaves(whole):
        if way[0] not in ("plant", "simulator"):
            said = said_of(whole, way, object())
            if not said.startswith(f"{path} "):
                wrong[path] = said
    assert wrong == {}


@pytest.mark.parametrize(
    ("experiment", "setting", "said"),
    [
        ("peg_in_hole", "speeds.linear_speed=-1", "speeds.linear_speed is -1"),
        ("peg_in_hole", "six.hold.tilt_axis=[0, 0, 0]", "six.hold.tilt_axis is zero"),
        (
            "plexiglas",
            "surface.properties.layer_stiffness=-1",
            "surface.properties.layer_stiffness",
        ),
        (
            "plexiglas",
            "surface.properties.mount_damping=2100",
            "surface.properties.mount_stiffness .* surface.properties.mount_damping .* diverges",
        ),
        ("bar", "internal.translation.mass=-1", "internal.translation.mass is not positive"),
        ("bar", "opened.stop_time=-1", "opened.stop_time is -1"),
        ("bar", "monitor.fall_time=1e-4", "monitor.fall_time is 0.0001 s, less than the sampling"),
        ("bar", "wrench=x", "Unknown wrench 'x'"),
        ("bar", "form=fused", "Unknown form 'fused'.* Valid: blocks, compiled"),
    ],
)
def test_a_scenario_is_refused_as_it_is_loaded(experiment: str, setting: str, said: str) -> None:
    with pytest.raises(ConfigurationError, match=f"^{said}"):
        get_experiment(experiment).scenario((), (setting,))


def test_a_mutual_pose_that_is_given_and_assumed_is_refused() -> None:
    settings = ("assumed.prescribed=true", "mutual_pose.position=[0, 1, 0]")
    with pytest.raises(ConfigurationError, match=r"mutual_pose and assumed\.prescribed both say"):
        get_experiment("bar").scenario((), settings)
