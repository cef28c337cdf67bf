"""When the null-space motion grows between readings, and that the watch knows: no simulation."""

import numpy as np
import pytest
from library_tree import ROOT
from pydrake.multibody.plant import MultibodyPlant
from redundant_arms import Resolver, arm_at, generated_arm, random_states

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.arm.state import ArmState
from geoimp_drake.parts.null_space import NullSpace
from geoimp_drake.robot_files.loading import load_robot

PERIOD = 1e-3


def light_arm() -> ControlModel:
    plant = MultibodyPlant(PERIOD)
    file = ROOT / "tests" / "robot_files" / "cases" / "light7.urdf"
    robot = load_robot(file, plant, end_effector="l7", geometry="leave-out")
    plant.Finalize()
    return ControlModel.of_arm(plant, robot.model_instance, robot.end_effector_frame)


MODELS = {"light": light_arm(), "eight": generated_arm(8)}
LIGHT = MODELS["light"]
# K_n [Nms/rad] at which some postures are stable and some are not.
CASES = [
    ("light", "inertia", 20.0),
    ("light", "identity", 1.5),
    ("eight", "inertia", 1e3),
    ("eight", "identity", 900.0),
]


def postures(model: ControlModel) -> list[np.ndarray]:
    at_rest = np.repeat([1.0, 0.0], model.num_joints)
    return [state * at_rest for state in random_states(model, 60, seed=5)]


def growth(resolver: Resolver, posture: np.ndarray) -> float:
    """Returns by how much null-space motion is multiplied at most from one reading to the next."""
    model, n = resolver.model, len(posture) // 2
    basis = np.linalg.svd(arm_at(model, posture).Jv_V_WE)[2][6:]
    step = []
    for e in 1e-6 * basis:  # so slow that the law is linear
        v = np.concatenate((posture[:n], e))
        step.append((e + PERIOD * resolver.at(v, arm_at(model, v).Jdot_v)) @ basis.T / 1e-6)
    return float(np.abs(np.linalg.eigvals(np.array(step))).max())


@pytest.mark.parametrize(("name", "weight", "K_n"), CASES)
def test_a_constant_gain_is_told_of_where_the_motion_grows_and_only_there(
    name, weight, K_n
) -> None:
    model = MODELS[name]
    W = None if weight == "inertia" else np.eye(model.num_joints)
    resolver = Resolver.of(model, K_n, weight=W)
    grows = [growth(resolver, posture) > 1.0 for posture in postures(model)]
    watch = NullSpace(model, K_n, weight=W, period=PERIOD).watch
    assert watch is not None
    told = [watch.is_too_large(arm_at(model, at), "arm", 0.0) for at in postures(model)]
    print(f"{name}, weight {weight}: {100 * np.mean(grows):.0f} % of postures are unstable")
    assert told == grows
    assert 0.1 < np.mean(grows) < 0.9


@pytest.mark.parametrize(("name", "weight", "K_n"), CASES)
def test_the_bound_that_comes_with_the_torques_misses_no_posture(name, weight, K_n) -> None:
    model = MODELS[name]
    W = None if weight == "inertia" else np.eye(model.num_joints)
    null_space, dynamics = NullSpace(model, K_n, weight=W, period=PERIOD), ChainDynamics(model)
    watch, gradients = null_space.watch, np.zeros((2, model.num_joints))
    assert watch is not None
    for at in postures(model):
        arm = dynamics.evaluate(None, at)
        *_, bound = dynamics.null_space(None, arm, gradients, null_space.arguments)
        np.testing.assert_allclose(bound, watch.bound(arm), rtol=1e-12)
        assert bound > watch.limit or not watch.is_too_large(arm, "arm", 0.0)


@pytest.mark.parametrize("name", MODELS)
def test_by_default_null_space_motion_falls_alike_in_every_posture(name) -> None:
    model = MODELS[name]
    resolver = Resolver.of(model)
    falls = [growth(resolver, posture) for posture in postures(model)]
    np.testing.assert_allclose(falls, 1.0 - 10.0 * PERIOD, atol=1e-6)


def test_it_is_told_once_and_with_the_number(caplog) -> None:
    null_space = NullSpace(LIGHT, 20.0, period=PERIOD)
    memory = null_space.memory.start.copy()
    q = np.array([0.3, 0.6, 0.2, 1.2, 0.1, 0.8, 0.0])
    evaluated: list[ArmState] = []

    def evaluate() -> ArmState:
        evaluated.append(arm_at(LIGHT, np.concatenate((q, np.zeros(7)))))
        return evaluated[-1]

    for time in (0.25, 0.5):
        null_space.check_gain(memory, 2001.0, evaluate, "arm", time)
    assert len(evaluated) == 1
    (record,) = caplog.records
    for text in ("arm: K_n", "t = 0.250 s", "0.001 s", "exceeds 2", "that is 2.59", "kappa"):
        assert text in record.getMessage()


def test_a_rate_and_an_arm_without_null_space_are_not_watched() -> None:
    assert NullSpace(LIGHT, kappa=5.0, period=PERIOD).watch is None
    assert NullSpace(LIGHT, 20.0).watch is None
    assert NullSpace(generated_arm(6), 20.0, period=PERIOD).watch is None
