"""Redundancy in scenario files: every kind of task from YAML, errors that list what is valid."""

from typing import Any

import numpy as np
import pytest
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed
from redundant_arms import FACING, Resolver, generated_arm, random_states, track_arm
from runs import run

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.config import RedundancyConfig
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.systems.arm.redundancy_resolver import RedundancyResolver
from geoimp_drake.systems.frame_motion import POSITION
from geoimp_drake.task_functions.config import KINDS
from geoimp_drake.task_functions.joint_limits import JointLimitDistance
from geoimp_drake.task_functions.joint_target import JointTarget
from geoimp_drake.task_functions.manipulability import Manipulability
from geoimp_drake.task_functions.plane_distance import PlaneDistance
from geoimp_drake.task_functions.posture import Posture
from geoimp_drake.task_functions.weighted_sum import WeightedSum
from geoimp_drake.validation import check

TRACK = track_arm()
A = np.array([0.5, -1.0, 2.0, 1.0, -0.3, 0.7])

ONE_OF_EVERYTHING = """
K_n: [10, 20, 30, 40, 50, 60, 70]
k_beta: -250
weight: matrix
weight_matrix: [1, 2, 3, 4, 5, 6, 7]
damping: {threshold: 0.02, factor: 0.03}
task:
  kind: weighted-sum
  weight: 2
  terms:
  - {kind: none}
  - {kind: joint-target, joints: [elbow, waist], target: [1.1, 0.2], initial: [0.7, 0.1],
     start: 1, duration: 3}
  - {kind: manipulability, weight: -0.5}
  - {kind: joint-limits, joints: [elbow], margin: 0.3, weight: -1}
  - {kind: plane-distance, link: link3, normal: [0, 1, 1], offset: 0.4, weight: 3}
"""


def load(text: str) -> RedundancyConfig:
    return yaml_load_typed(schema=RedundancyConfig, data=text, defaults=RedundancyConfig())


def made(config: RedundancyConfig, model: ControlModel = TRACK, *task: Any) -> RedundancyResolver:
    return RedundancyResolver.of(RedundancyResolver.part_of(model, config.make(model, *task)))


def value_and_acceleration(system: RedundancyResolver) -> np.ndarray:
    resolver = Resolver(TRACK, system)
    resolver.start_at(FACING)
    alpha = resolver.at(random_states(TRACK, 1)[0], A, 2.0)
    return np.append(alpha, resolver.read("task_value"))


def test_one_of_everything_is_what_it_says() -> None:
    task = WeightedSum(
        [
            (
                2.0,
                JointTarget(
                    TRACK, ["elbow", "waist"], [1.1, 0.2], initial=[0.7, 0.1], start=1, duration=3
                ),
            ),
            (-1.0, Manipulability()),
            (-2.0, JointLimitDistance(TRACK, ["elbow"], 0.3)),
            (6.0, PlaneDistance(TRACK, "link3", [0, 1, 1], 0.4)),
        ]
    )
    by_hand = RedundancyResolver(
        TRACK,
        np.arange(10.0, 80.0, 10.0),
        k_beta=-250.0,
        task=task,
        weight=np.diag(np.arange(1.0, 8.0)),
    )
    config = load(ONE_OF_EVERYTHING)
    expected = value_and_acceleration(by_hand)
    np.testing.assert_allclose(value_and_acceleration(made(config)), expected, atol=1e-9)
    assert (config.damping.threshold, config.damping.factor) == (0.02, 0.03)


def test_dumped_and_loaded_again_it_is_the_same() -> None:
    config = load(ONE_OF_EVERYTHING)
    again = load(yaml_dump_typed(config))
    assert yaml_dump_typed(again) == yaml_dump_typed(config)


def test_default_holds_the_posture_and_the_task_none_damps_towards_rest() -> None:
    held = RedundancyResolver(TRACK, kappa=10.0, k_beta=-30.0, task=Posture(TRACK))
    damped = RedundancyResolver(TRACK, kappa=10.0)
    for text, by_hand in (("{}", held), ("task: {kind: none}", damped)):
        np.testing.assert_array_equal(
            value_and_acceleration(made(load(text))), value_and_acceleration(by_hand)
        )


@pytest.mark.parametrize("joints", [6, 7, 8])
def test_default_serves_arms_of_any_number_of_joints(joints: int) -> None:
    model = generated_arm(joints)
    resolver = Resolver(model, made(RedundancyConfig(), model))
    assert np.isfinite(resolver.at(random_states(model, 1)[0], A)).all()


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_can_be_made(kind: str) -> None:
    config = load(f"task: {{kind: {kind}}}")
    config.task.joints = ["elbow"]
    config.task.link = "link2"
    if kind == "weighted-sum":
        config.task.terms = load(ONE_OF_EVERYTHING).task.terms
    assert np.isfinite(value_and_acceleration(made(config))).all()


def test_given_task_function_replaces_the_configured_one() -> None:
    config = load("{k_beta: 3, task: {kind: joint-target, joints: [elbow], target: [1.1]}}")
    given = value_and_acceleration(made(config, TRACK, Manipulability()))
    expected = RedundancyResolver(TRACK, kappa=10.0, k_beta=3.0, task=Manipulability())
    np.testing.assert_array_equal(given, value_and_acceleration(expected))


BAD = {
    "K_n: -3": ["redundancy.K_n", "-3"],
    "K_n: [[1, 2], [0, 1]]": ["redundancy.K_n", "symmetric"],
    "K_n: .nan": ["redundancy.K_n", "finite"],
    "kappa: 0": ["redundancy.kappa", "0 1/s", "positive"],
    "{K_n: 20, kappa: 5}": ["redundancy.K_n is 20", "redundancy.kappa is 5 1/s", "one of them"],
    "k_beta: .inf": ["redundancy.k_beta", "inf"],
    "weight: B": ["redundancy.weight", "'B'", "inertia", "identity", "matrix"],
    "weight: matrix": ["weight_matrix", "not given"],
    "weight_matrix: [1, 2]": ["'inertia'", "weight_matrix", "given"],
    "{weight: matrix, weight_matrix: [1, -2]}": ["weight_matrix", "-2"],
    "damping: {threshold: -1}": ["redundancy.damping.threshold", "-1"],
    "damping: {factor: 0}": ["redundancy.damping.factor", "0"],
    "task: {kind: joint-targets}": ["task.kind", "Did you mean 'joint-target'", "weighted-sum"],
    "task: {kind: weighted-sum}": ["redundancy.task.terms", "empty"],
    "task: {kind: weighted-sum, terms: [{kind: weighted-sum}]}": ["terms.0.kind", "manipulability"],
    "task: {kind: none, weight: .nan}": ["redundancy.task.weight", "nan"],
}
BAD_FOR_THIS_ARM = {
    "K_n: [1, 2, 3]": ["K_n", "(3,)", "7"],
    "{weight: matrix, weight_matrix: [1, 2]}": ["weight", "(2,)", "7"],
    "task: {kind: joint-target, joints: [elbo], target: [1]}": ["'elbo'", "'elbow'", "track"],
    "task: {kind: joint-target, joints: [elbow], target: [9]}": ["elbow", "9.0000", "2.1817"],
    "task: {kind: joint-limits, joints: [hip]}": ["'hip'", "wrist_pitch"],
    "task: {kind: plane-distance, link: elbow}": ["link 'elbow'", "carriage"],
}


@pytest.mark.parametrize("text", BAD)
def test_what_no_arm_could_use_is_refused_before_there_is_one(text: str) -> None:
    with pytest.raises(ConfigurationError) as error:
        check(load(text), "redundancy")
    for part in BAD[text]:
        assert part in str(error.value)


@pytest.mark.parametrize("text", BAD_FOR_THIS_ARM)
def test_what_does_not_fit_the_arm_is_refused_with_the_valid_names(text: str) -> None:
    config = load(text)
    check(config)
    with pytest.raises(ConfigurationError) as error:
        config.make(TRACK)
    for part in BAD_FOR_THIS_ARM[text]:
        assert part in str(error.value)


@pytest.mark.parametrize(
    ("task", "drift"), [("null", (0.0, 0.02)), ("{kind: none}", (0.03, np.inf))]
)
def test_without_a_task_an_arm_holds_its_posture_where_its_links_are_heavier(task, drift):
    idle = ("form=compiled", "duration=10", "segments=[]", "redundancy.k_beta=0")
    heavy = ("world.links.mass=1.1", "redundancy.K_n=0", f"redundancy.task={task}")
    log, _, failure = run("redundancy", *idle, *heavy)
    assert failure is None
    least, most = drift
    assert least <= np.abs(log["seven/q"] - log["seven/q"][0]).max() < most
    # The end effector is where it is without: 0.34 mm off D.
    offset = np.linalg.norm((log["seven/motion_E"] - log["seven/motion_D"])[:, POSITION], axis=1)
    assert offset.max() == pytest.approx(0.343e-3, abs=2e-6)
