"""Gradients and rates of every task function are derivatives of its value; sums, errors, names."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.multibody.tree import JacobianWrtVariable
from redundant_arms import arm_at, generated_arm, random_states, track_arm

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import ConfigurationError, SingularityError
from geoimp_drake.laws.redundancy.kept_posture import kept_posture
from geoimp_drake.task_functions.joint_limits import JointLimitDistance
from geoimp_drake.task_functions.joint_target import JointTarget
from geoimp_drake.task_functions.manipulability import Manipulability
from geoimp_drake.task_functions.plane_distance import PlaneDistance
from geoimp_drake.task_functions.posture import Posture
from geoimp_drake.task_functions.task_function import Instant, NoTask
from geoimp_drake.task_functions.user_function import UserFunction
from geoimp_drake.task_functions.weighted_sum import WeightedSum

MODEL = generated_arm(7)
TRACK = track_arm()
AFTER = ["joint2", "joint4"]


def quadratic(t: float, q: np.ndarray) -> float:
    return float(0.5 * q @ q * np.cos(t) + q[0] * q[3])


def quadratic_gradient(t: float, q: np.ndarray) -> np.ndarray:
    gradient = q * np.cos(t)
    gradient[[0, 3]] += q[[3, 0]]
    return gradient


TASKS = {
    "none": NoTask(),
    "joint target": JointTarget(MODEL, AFTER, [0.5, -0.4], start=0.2, duration=2.0),
    "joint target from a given value": JointTarget(MODEL, AFTER, [0.5, -0.4], initial=[0.0, 0.1]),
    "manipulability": Manipulability(),
    "posture": Posture(MODEL),
    "joint limits, all of the range": JointLimitDistance(MODEL, margin=1.0),
    "joint limits, margin": JointLimitDistance(MODEL, margin=0.9),
    "plane of the last link": PlaneDistance(MODEL, "link7", [1.0, 2.0, -0.5], 0.3),
    "plane of a link in the middle": PlaneDistance(MODEL, "link4", [0.0, 0.0, 2.0]),
    "user": UserFunction(MODEL, quadratic, quadratic_gradient),
    "sum": WeightedSum(
        [(2.0, Manipulability()), (-0.5, PlaneDistance(MODEL, "link4", np.ones(3)))]
    ),
}
every_task = pytest.mark.parametrize("name", TASKS)


def instant(state: np.ndarray, time: float = 0.0, model=MODEL) -> Instant:
    scratch = model.plant.CreateDefaultContext()
    model.plant.SetPositionsAndVelocities(scratch, state)
    q, v = state.reshape(2, -1)
    start = np.full(model.num_joints, 0.2)
    return Instant(time, q, v, start, lambda: arm_at(model, state), lambda: scratch)


def along(state: np.ndarray, dt: float) -> np.ndarray:
    """Returns the state after a short while at constant joint velocity."""
    q, v = state.reshape(2, -1)
    return np.concatenate((q + dt * v, v))


def rate(function, dt: float = 1e-4) -> np.ndarray:
    f = [np.asarray(function(k * dt)) for k in (-2, -1, 1, 2)]
    return (f[0] - 8.0 * f[1] + 8.0 * f[2] - f[3]) / (12.0 * dt)


@every_task
def test_gradient_is_that_of_the_value(name: str) -> None:
    task, n = TASKS[name], MODEL.num_joints
    for state in random_states(MODEL, 5):

        def value(q: np.ndarray, state=state) -> float:
            return task.evaluate(instant(np.concatenate((q, state[n:])), 0.9)).value

        expected = [rate(lambda s, e=e, q=state[:n]: value(q + s * e)) for e in np.eye(n)]
        ours = task.evaluate(instant(state, 0.9)).gradient
        np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-9)


def test_a_posture_is_kept_by_a_law_with_the_same_numbers_compiled_or_not() -> None:
    state, start = random_states(MODEL, 1)[0], np.full(MODEL.num_joints, 0.2)
    n = len(start)
    B = inertia_at(start)
    gradients = np.zeros((2, 2, n))
    plain = kept_posture(B, start, state, gradients[0])
    np.testing.assert_allclose(
        compiled(kept_posture)(B, start, state, gradients[1]), plain, rtol=1e-14
    )
    np.testing.assert_allclose(gradients[1], gradients[0], rtol=1e-14)
    e = state[:n] - start
    np.testing.assert_allclose(plain, [0.5 * e @ B @ e, e @ B @ state[n:]], rtol=1e-12)
    np.testing.assert_allclose(gradients[0], [B @ e, B @ state[n:]], rtol=1e-12)
    state[0] = np.nan
    assert np.isnan(kept_posture(B, start, state, gradients[0])).all()
    assert np.isnan(gradients[0]).all()


def test_a_posture_is_that_of_the_start_it_is_told_of() -> None:
    task, state = Posture(MODEL), random_states(MODEL, 1)[0]
    at = instant(state)
    for start in (at.start_posture, at.start_posture + 0.1, at.q):
        value = task.evaluate(replace(at, start_posture=start))
        expected = inertia_at(start) @ (at.q - start)
        np.testing.assert_allclose(value.gradient, expected, rtol=0, atol=1e-12)


def inertia_at(q: np.ndarray) -> np.ndarray:
    context = MODEL.plant.CreateDefaultContext()
    MODEL.plant.SetPositions(context, q)
    return MODEL.plant.CalcMassMatrix(context)


@every_task
def test_rates_are_those_along_the_motion_and_in_time(name: str) -> None:
    task, t = TASKS[name], 0.9
    for state in random_states(MODEL, 5):

        def after(dt: float, state=state):
            return task.evaluate(instant(along(state, dt), t + dt))

        ours = after(0.0)
        assert ours.value_rate == pytest.approx(rate(lambda s: after(s).value), abs=1e-8)
        expected = rate(lambda s: after(s).gradient)
        np.testing.assert_allclose(ours.gradient_rate, expected, rtol=0, atol=1e-7)


def test_joint_target_runs_from_the_start_posture_to_its_target_and_stays() -> None:
    task = JointTarget(MODEL, AFTER, [0.5, -0.4], start=1.0, duration=2.0)
    state = random_states(MODEL, 1)[0]
    q = {t: task.desired(instant(state, t))[0] for t in (0.0, 1.0, 2.0, 3.0, 9.0)}
    np.testing.assert_allclose(q[0.0], [0.2, 0.2], atol=1e-15)
    np.testing.assert_allclose(q[1.0], [0.2, 0.2], atol=1e-15)
    np.testing.assert_allclose(q[2.0], [0.35, -0.1], atol=1e-12)
    np.testing.assert_allclose(q[3.0], [0.5, -0.4], atol=1e-12)
    np.testing.assert_allclose(q[9.0], [0.5, -0.4], atol=1e-12)
    for t in (0.0, 1.0, 3.0, 9.0):
        np.testing.assert_allclose(task.desired(instant(state, t))[1], 0.0, atol=1e-12)


def test_joint_target_reaches_its_acceleration_smoothly() -> None:
    task = JointTarget(MODEL, AFTER, [0.5, -0.4], start=1.0, duration=2.0)
    state = random_states(MODEL, 1)[0]
    speed = rate(lambda s: task.desired(instant(state, 2.3 + s))[0])
    np.testing.assert_allclose(task.desired(instant(state, 2.3))[1], speed, atol=1e-9)
    just_after = task.desired(instant(state, 1.001))[1]
    np.testing.assert_allclose(just_after, 0.0, atol=1e-5)  # grows with the square of time


def test_joint_limit_distance_is_zero_until_the_margin_and_minus_half_at_a_limit() -> None:
    task = JointLimitDistance(MODEL, ["joint5"], margin=0.25)
    state = np.zeros(14)
    for q, expected in ((0.0, 0.0), (1.5, 0.0), (-1.5, 0.0), (2.0, -0.5), (-2.0, -0.5)):
        state[4] = q
        assert task.evaluate(instant(state)).value == pytest.approx(expected, abs=1e-15)
    state[4] = 1.9
    assert task.evaluate(instant(state)).gradient[4] < 0.0


def test_plane_distance_is_that_of_the_links_origin() -> None:
    task = PlaneDistance(TRACK, "link3", np.array([0.0, 3.0, 4.0]), 0.5)
    state = random_states(TRACK, 1)[0]
    now = instant(state, model=TRACK)
    body = TRACK.plant.GetBodyByName("link3")
    p = TRACK.plant.EvalBodyPoseInWorld(now.scratch, body).translation()
    result = task.evaluate(now)
    assert result.value == pytest.approx(0.6 * p[1] + 0.8 * p[2] - 0.5, abs=1e-12)
    W = TRACK.plant.world_frame()
    J = TRACK.plant.CalcJacobianTranslationalVelocity(
        now.scratch, JacobianWrtVariable.kV, body.body_frame(), np.zeros(3), W, W
    )
    np.testing.assert_allclose(result.gradient, [0.0, 0.6, 0.8] @ J, atol=1e-12)


def test_manipulability_at_a_singularity_has_a_named_error() -> None:
    now = instant(random_states(MODEL, 1)[0])
    J = now.arm.Jv_V_WE.copy()
    J[5] = 0.0
    with pytest.raises(SingularityError, match=r"manipulability is zero"):
        Manipulability().evaluate(
            replace(now, evaluate_arm=lambda: replace(now.arm, Jv_V_WE=J)),
        )


def wrong_gradient(t: float, q: np.ndarray) -> np.ndarray:
    gradient = quadratic_gradient(t, q)
    gradient[2] *= 1.01
    return gradient


ERRORS = {
    "unknown joint": (
        lambda: JointTarget(TRACK, ["ellbow"], [1.0]),
        ["'ellbow'", "Did you mean 'elbow'", "track", "tool_roll"],
    ),
    "joint twice": (lambda: JointTarget(TRACK, ["elbow", "elbow"], [1.0, 2.0]), ["once"]),
    "no joint": (lambda: JointTarget(TRACK, [], []), ["no joint", "elbow"]),
    "target beyond a limit": (
        lambda: JointTarget(TRACK, ["elbow"], [2.3]),
        ["elbow", "2.3000", "-2.7053", "2.1817"],
    ),
    "too few targets": (lambda: JointTarget(TRACK, ["elbow", "waist"], [1.0]), ["target", "2"]),
    "target NaN": (lambda: JointTarget(TRACK, ["elbow"], [np.nan]), ["target"]),
    "no duration": (lambda: JointTarget(TRACK, ["elbow"], [1.0], duration=0.0), ["duration", "0"]),
    "negative start": (lambda: JointTarget(TRACK, ["elbow"], [1.0], start=-1.0), ["start", "-1"]),
    "unknown link": (
        lambda: PlaneDistance(TRACK, "upper_arm", np.ones(3)),
        ["'upper_arm'", "carriage", "link6"],
    ),
    "no normal": (lambda: PlaneDistance(TRACK, "link2", np.zeros(3)), ["normal is zero"]),
    "offset NaN": (lambda: PlaneDistance(TRACK, "link2", np.ones(3), np.nan), ["offset", "nan"]),
    "margin": (lambda: JointLimitDistance(TRACK, margin=1.5), ["margin", "1.5"]),
    "limits of an unknown joint": (lambda: JointLimitDistance(TRACK, ["hip"]), ["'hip'", "elbow"]),
    "empty sum": (lambda: WeightedSum([]), ["no terms"]),
    "weight NaN": (lambda: WeightedSum([(np.nan, NoTask())]), ["Weight 0", "nan"]),
    "wrong gradient": (lambda: UserFunction(MODEL, quadratic, wrong_gradient), ["joint3", "wrong"]),
    "gradient NaN": (
        lambda: UserFunction(MODEL, quadratic, lambda t, q: q * np.nan),
        ["joint1", "nan"],
    ),
    "gradient's shape": (
        lambda: UserFunction(MODEL, quadratic, lambda t, q: q[:2]),
        ["(2,)", "(7,)"],
    ),
}


@pytest.mark.parametrize("case", ERRORS)
def test_what_cannot_be_used_is_refused_with_names_and_numbers(case: str) -> None:
    make, texts = ERRORS[case]
    with pytest.raises(ConfigurationError) as error:
        make()
    for text in texts:
        assert text in str(error.value)
