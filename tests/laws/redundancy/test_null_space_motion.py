"""What (3.32)-(3.39) promise of the null-space motion: generated arms and the arm on the track."""

import numpy as np
import pytest
from redundant_arms import (
    FACING,
    Resolver,
    arm_at,
    generated_arm,
    random_states,
    simulate,
    track_arm,
)

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.derivatives import inertia_rate
from geoimp_drake.laws.redundancy.pseudo_inverse import (
    null_space_projector,
    weighted_pseudo_inverse,
)
from geoimp_drake.task_functions.joint_target import JointTarget
from geoimp_drake.task_functions.manipulability import Manipulability

MODELS = {"seven": generated_arm(7), "eight": generated_arm(8), "track": track_arm()}
every_arm = pytest.mark.parametrize("name", MODELS)
ZERO = np.zeros(6)


def projector(model: ControlModel, state: np.ndarray) -> np.ndarray:
    arm = arm_at(model, state)
    return null_space_projector(
        arm.Jv_V_WE, weighted_pseudo_inverse(arm.Jv_V_WE, np.linalg.inv(arm.B))
    )


def waving(t: float) -> np.ndarray:
    """A task acceleration under which the end effector keeps near where it is."""
    return 0.5 * np.cos(np.array([3.0, 4.0, 5.0, 3.5, 4.5, 5.5]) * t)


def moving_target(model: ControlModel) -> JointTarget:
    joint = model.joint_names[3]
    return JointTarget(model, [joint], [0.9], initial=[0.3], duration=1.0)


def start(model: ControlModel) -> np.ndarray:
    state = random_states(model, 1, seed=3)[0]
    if "elbow" in model.joint_names:
        state[: model.num_joints] = FACING
    state[model.num_joints :] = np.linspace(-0.4, 0.5, model.num_joints)
    return state


def rate(values, step: float) -> np.ndarray:
    """Returns the time derivative of evenly spaced values, to fourth order, two fewer a side."""
    x = np.asarray(values)
    return (x[:-4] - 8.0 * x[1:-3] + 8.0 * x[3:-1] - x[4:]) / (12.0 * step)


@every_arm
@pytest.mark.parametrize("weight", ["inertia", "identity"])
def test_null_space_acceleration_does_not_move_the_end_effector(name: str, weight: str) -> None:
    model = MODELS[name]
    W = None if weight == "inertia" else np.eye(model.num_joints)
    resolver = Resolver.of(model, k_beta=50.0, task=Manipulability(), weight=W)
    for state in random_states(model, 10):
        arm = arm_at(model, state)
        # With a = J̇q̇ (3.32) leaves α_n alone.
        alpha_n = resolver.at(state, arm.Jdot_v)
        assert np.linalg.norm(alpha_n) > 0.1
        np.testing.assert_allclose(arm.Jv_V_WE @ alpha_n, ZERO, atol=1e-10)


@every_arm
def test_task_function_leaves_the_end_effector_acceleration_unchanged(name: str) -> None:
    model = MODELS[name]
    a = np.array([0.5, -1.0, 2.0, 1.0, -0.3, 0.7])
    for state in random_states(model, 10):
        arm = arm_at(model, state)
        alphas = [
            Resolver.of(model, k_beta=k_beta, task=moving_target(model)).at(state, a, 0.4)
            for k_beta in (-300.0, 0.0, 300.0)
        ]
        assert np.linalg.norm(alphas[0] - alphas[2]) > 0.01
        for alpha in alphas:
            np.testing.assert_allclose(arm.Jv_V_WE @ alpha + arm.Jdot_v, a, rtol=0, atol=1e-9)


def null_space_part_of_a_wrench(model: ControlModel, state: np.ndarray, W_inverse) -> np.ndarray:
    """Returns what an uncompensated wrench adds to the joint acceleration, in the null space."""
    arm = arm_at(model, state)
    h = np.array([2.0, -3.0, 1.0, 30.0, -20.0, 40.0])
    J_pinv = weighted_pseudo_inverse(arm.Jv_V_WE, W_inverse)
    return null_space_projector(arm.Jv_V_WE, J_pinv) @ np.linalg.solve(arm.B, arm.Jv_V_WE.T @ h)


@every_arm
def test_wrench_moves_the_null_space_unless_the_weight_is_the_inertia(name: str) -> None:
    model = MODELS[name]
    for state in random_states(model, 10):
        B_inverse = np.linalg.inv(arm_at(model, state).B)
        dynamic = null_space_part_of_a_wrench(model, state, B_inverse)
        kinematic = null_space_part_of_a_wrench(model, state, np.eye(model.num_joints))
        assert np.linalg.norm(dynamic) < 1e-10
        assert np.linalg.norm(kinematic) > 1e-2


@every_arm
@pytest.mark.parametrize("kind", ["damping", "joint target", "manipulability"])
def test_error_energy_decays_at_the_rate_of_the_gain(name: str, kind: str) -> None:
    model = MODELS[name]
    n = model.num_joints
    K_n = np.diag(np.linspace(2.0, 10.0, n))
    task = {
        "damping": None,
        "joint target": moving_target(model),
        "manipulability": Manipulability(),
    }[kind]
    resolver = Resolver.of(model, K_n, k_beta={"joint target": -20.0}.get(kind, 5.0), task=task)
    step = 4e-3
    rows = simulate(resolver, start(model), waving, 0.16, step)
    energies, powers = [], []
    for row in rows:
        resolver.at(row[1:], waving(row[0]), row[0])
        e_n = resolver.read("null_space_error")
        energies.append(0.5 * e_n @ arm_at(model, row[1:]).B @ e_n)
        powers.append(-e_n @ K_n @ e_n)
    error = np.abs(rate(energies, step) - np.array(powers)[2:-2]).max() / np.abs(powers).max()
    print(f"{name}, {kind}: V̇ + eᵀKe relative to its largest value {error:.1e}")
    assert energies[-1] < 0.98 * energies[0]
    assert error < 1e-5


@every_arm
def test_error_energy_decays_at_the_given_rate_in_any_posture(name: str) -> None:
    model, kappa, duration = MODELS[name], 4.0, 0.16
    resolver = Resolver.of(model, kappa=kappa, k_beta=-40.0, task=moving_target(model))
    rows = simulate(resolver, start(model), waving, duration, 4e-3)

    def energy(row: np.ndarray) -> float:
        resolver.at(row[1:], waving(row[0]), row[0])
        e_n = resolver.read("null_space_error")
        return float(0.5 * e_n @ arm_at(model, row[1:]).B @ e_n)

    rate = np.log(energy(rows[0]) / energy(rows[-1])) / duration
    print(f"{name}: V decays at {rate:.6f} 1/s, 2κ is {2 * kappa:g}")
    assert rate == pytest.approx(2 * kappa, rel=1e-4)


@every_arm
def test_error_obeys_the_closed_loop_equation(name: str) -> None:
    # (3.38) in (3.37): Bė_n + (K_n + C)e_n has no part in the null space, whatever β does.
    model = MODELS[name]
    resolver = Resolver.of(model, 5.0, k_beta=-40.0, task=moving_target(model))
    step = 5e-4
    rows = simulate(resolver, start(model), waving, 4 * step, step)

    def error(row: np.ndarray) -> np.ndarray:
        resolver.at(row[1:], waving(row[0]), row[0])
        return resolver.read("null_space_error")

    (de,) = rate([error(row) for row in rows], step)
    e, (q, v), arm = error(rows[2]), rows[2, 1:].reshape(2, -1), arm_at(model, rows[2, 1:])
    plant, scratch = model.plant, model.plant.CreateDefaultContext()

    def c(velocity: np.ndarray) -> np.ndarray:
        plant.SetPositionsAndVelocities(scratch, np.concatenate((q, velocity)))
        return plant.CalcBiasTerm(scratch)

    C_e = 0.25 * (c(v + e) - c(v - e))
    N = projector(model, rows[2, 1:])
    left = N @ np.linalg.solve(arm.B, arm.B @ de + 5.0 * e + C_e)
    scale = np.linalg.norm(N @ de)
    print(f"{name}: closed-loop equation of e_n holds to {np.linalg.norm(left) / scale:.1e}")
    assert np.linalg.norm(left) < 1e-6 * scale


def test_energy_and_christoffel_term_belong_together() -> None:
    # Ḃ − 2C is skew: eᵀ(½Ḃe − Ce) = 0, without which V̇ would have a third term.
    model = MODELS["track"]
    scratch = model.plant.CreateDefaultContext()
    state = random_states(model, 1)[0]
    q, v = state.reshape(2, -1)
    e = np.linspace(-1.0, 1.0, len(q))
    dB = inertia_rate(model, scratch, q, v)

    def c(velocity: np.ndarray) -> np.ndarray:
        model.plant.SetVelocities(scratch, velocity)
        return model.plant.CalcBiasTerm(scratch)

    C_e = 0.5 * (c(v + e) - c(v) - c(e))
    assert abs(e @ (0.5 * dB @ e - C_e)) < 1e-6 * abs(e @ C_e)


@pytest.mark.parametrize(("k_beta", "climbs"), [(200.0, True), (-200.0, False)])
def test_positive_gain_climbs_and_negative_descends(k_beta: float, climbs: bool) -> None:
    model = MODELS["seven"]
    resolver = Resolver.of(model, k_beta=k_beta, task=Manipulability())
    state = start(model)
    state[model.num_joints :] = 0.0
    rows = simulate(resolver, state, lambda t: ZERO, 0.3, 0.01)

    def w(row: np.ndarray) -> float:
        resolver.at(row[1:], ZERO)
        return float(resolver.read("task_value")[0])

    assert (w(rows[-1]) > w(rows[0])) == climbs
