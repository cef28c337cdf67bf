"""The resolver as a Drake system: six, seven and eight joints, state in the Context, errors."""

from dataclasses import dataclass

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from redundant_arms import FACING, Resolver, arm_at, generated_arm, random_states, track_arm

from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.errors import ConfigurationError, SignalError, SingularityError
from geoimp_drake.laws.motion_control.resolved_acceleration import resolved_acceleration
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import SingularityDamping
from geoimp_drake.systems.arm.redundancy_resolver import RedundancyResolver
from geoimp_drake.task_functions.joint_target import JointTarget
from geoimp_drake.task_functions.manipulability import Manipulability
from geoimp_drake.task_functions.task_function import Instant, NoTask, TaskValue

MODELS = {n: generated_arm(n) for n in (6, 7, 8)}
TRACK = track_arm()
A = np.array([0.5, -1.0, 2.0, 1.0, -0.3, 0.7])


def test_six_joints_give_the_law_without_redundancy() -> None:
    model = MODELS[6]
    resolver = Resolver.of(model, task=Manipulability(), k_beta=3.0)
    for state in random_states(model, 20):
        arm = arm_at(model, state)
        expected = resolved_acceleration(arm.Jv_V_WE, arm.Jdot_v, A)
        np.testing.assert_allclose(resolver.at(state, A), expected, rtol=1e-12, atol=1e-12)
        np.testing.assert_array_equal(resolver.read("null_space_error"), np.zeros(6))
        sigma = np.linalg.svd(arm.Jv_V_WE, compute_uv=False)[-1]
        assert resolver.read("smallest_singular_value")[0] == pytest.approx(sigma, rel=1e-12)


def test_six_joints_in_a_singular_posture_have_a_named_error() -> None:
    model = MODELS[6]
    arm = arm_at(model, random_states(model, 1)[0])
    arm.Jv_V_WE[:, 5] = 0.0
    resolver = Resolver.of(model)
    resolver.system.GetInputPort("arm").FixValue(resolver.context, AbstractValue.Make(arm))
    resolver.system.GetInputPort("task_acceleration").FixValue(resolver.context, A)
    with pytest.raises(SingularityError, match=r"singular"):
        resolver.read("joint_acceleration")


@pytest.mark.parametrize("joints", MODELS)
@pytest.mark.parametrize("weight", [None, "identity", "full"])
def test_end_effector_gets_the_acceleration_that_was_asked(joints: int, weight) -> None:
    model = MODELS[joints]
    root = np.random.default_rng(0).standard_normal((joints, joints))
    W = {None: None, "identity": np.eye(joints), "full": root @ root.T + np.eye(joints)}[weight]
    resolver = Resolver.of(model, weight=W)
    for state in random_states(model, 5):
        arm = arm_at(model, state)
        alpha = resolver.at(state, A)
        assert alpha.shape == (joints,)
        np.testing.assert_allclose(arm.Jv_V_WE @ alpha + arm.Jdot_v, A, rtol=0, atol=1e-9)


def test_weight_decides_which_joints_move() -> None:
    state = random_states(MODELS[7], 1)[0]
    state[7:] = 0.0
    W = np.eye(7)
    W[3, 3] = 1e6
    light = Resolver.of(MODELS[7], weight=np.eye(7)).at(state, A)
    heavy = Resolver.of(MODELS[7], weight=W).at(state, A)
    assert abs(heavy[3]) < 1e-3 * abs(light[3])


def test_contexts_of_one_system_are_independent() -> None:
    task = JointTarget(TRACK, ["elbow"], [1.1], duration=2.0)
    system = RedundancyResolver(TRACK, k_beta=-250.0, task=task)
    one, other = Resolver(TRACK, system), Resolver(TRACK, system)
    state = np.concatenate((FACING, np.full(7, 0.1)))
    one.start_at(FACING)
    other.start_at(FACING - 0.3)
    first = one.at(state, A, 1.0)
    second = other.at(state, A, 1.0)
    assert np.linalg.norm(first - second) > 0.1
    clone = Resolver(TRACK, system)
    clone.context = one.context.Clone()
    np.testing.assert_array_equal(clone.at(state, A, 1.0), first)
    np.testing.assert_array_equal(one.at(state, A, 1.0), first)


def test_posture_at_initialization_starts_the_target() -> None:
    task = JointTarget(TRACK, ["elbow"], [1.1], duration=2.0)
    resolver = Resolver.of(TRACK, k_beta=-250.0, task=task)
    state = np.concatenate((FACING, np.zeros(7)))
    simulator = Simulator(resolver.system, resolver.context)
    resolver.at(state, A)
    simulator.AdvanceTo(1e-3)
    assert resolver.read("task_value")[0] == pytest.approx(0.0, abs=1e-6)
    moved = state.copy()
    moved[3] += 0.1
    resolver.at(moved, A)
    assert resolver.read("task_value")[0] == pytest.approx(0.005, abs=1e-12)
    resolver.at(moved, A, 5.0)
    expected = 0.5 * (moved[3] - 1.1) ** 2
    assert resolver.read("task_value")[0] == pytest.approx(expected, abs=1e-12)
    resolver.at(moved, A)
    simulator.Initialize()
    simulator.AdvanceTo(1e-3)
    resolver.at(moved, A)
    assert resolver.read("task_value")[0] == 0.0  # started again, from where it is then


def test_ports_can_be_read_without_initialization() -> None:
    task = JointTarget(TRACK, ["elbow"], [1.1], duration=2.0)
    resolver = Resolver.of(TRACK, k_beta=-250.0, task=task)
    alpha = resolver.at(np.concatenate((FACING, np.zeros(7))), A)
    assert np.isfinite(alpha).all()
    assert resolver.read("task_value")[0] == 0.0


@dataclass
class Counting:
    """A task function that counts how often it is asked."""

    count: int = 0

    def evaluate(self, instant: Instant) -> TaskValue:
        self.count += 1
        return NoTask().evaluate(instant)


def test_the_task_is_evaluated_once_for_an_acceleration() -> None:
    task = Counting()
    resolver = Resolver.of(TRACK, task=task)
    resolver.at(np.concatenate((FACING, np.zeros(7))), A)
    resolver.read("joint_acceleration")
    resolver.read("smallest_singular_value")
    assert task.count == 1


@pytest.mark.parametrize("K_n", [0.0, 500.0])
def test_an_arm_evaluated_by_drake_and_by_the_chain_is_resolved_alike(K_n: float) -> None:
    resolver = Resolver.of(TRACK, K_n, k_beta=20.0, task=Manipulability())
    chain = ChainDynamics(TRACK)
    for state in random_states(TRACK, 5):
        by_drake = resolver.at(state, A)
        arm = AbstractValue.Make(chain.evaluate(None, state))
        resolver.system.GetInputPort("arm").FixValue(resolver.context, arm)
        by_chain = resolver.read("joint_acceleration")
        np.testing.assert_allclose(by_chain, by_drake, atol=1e-7 * np.abs(by_drake).max())


def test_zero_gain_reports_the_task_value_and_does_nothing_else() -> None:
    state = random_states(TRACK, 1)[0]
    plain, reporting = Resolver.of(TRACK), Resolver.of(TRACK, task=Manipulability())
    np.testing.assert_allclose(reporting.at(state, A), plain.at(state, A), rtol=0, atol=1e-12)
    J = arm_at(TRACK, state).Jv_V_WE
    expected = np.prod(np.linalg.svd(J, compute_uv=False))
    assert reporting.read("task_value")[0] == pytest.approx(expected, rel=1e-9)


ERRORS = {
    "K_n of the wrong size": (lambda: RedundancyResolver(TRACK, np.ones(6)), ["K_n", "(6,)", "7"]),
    "K_n negative": (lambda: RedundancyResolver(TRACK, -1.0), ["K_n", "positive definite", "-1"]),
    "weight not symmetric": (
        lambda: RedundancyResolver(TRACK, weight=np.eye(7) + np.eye(7, k=1)),
        ["weight", "not symmetric"],
    ),
    "k_beta": (lambda: RedundancyResolver(TRACK, k_beta=np.inf), ["k_beta", "inf"]),
    "threshold": (
        lambda: RedundancyResolver(TRACK, damping=SingularityDamping(-0.1)),
        ["damping.threshold", "-0.1"],
    ),
    "factor": (
        lambda: RedundancyResolver(TRACK, damping=SingularityDamping(0.1, 0.0)),
        ["damping.factor", "0"],
    ),
}


@pytest.mark.parametrize("case", ERRORS)
def test_gains_that_cannot_be_used_are_refused(case: str) -> None:
    make, texts = ERRORS[case]
    with pytest.raises(ConfigurationError) as error:
        make()
    for text in texts:
        assert text in str(error.value)


@pytest.mark.parametrize("joints", MODELS)
def test_task_acceleration_that_is_not_finite_is_refused(joints: int) -> None:
    resolver = Resolver.of(MODELS[joints])
    a = A.copy()
    a[2] = np.nan
    with pytest.raises(SignalError, match=r"task_acceleration.*2: nan"):
        resolver.at(random_states(MODELS[joints], 1)[0], a)
