"""Kinematics and dynamics of laws/serial_chain.py are Drake's; Ḃ and C are exact."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from autodiff_arm import AutoDiffArm
from redundant_arms import arm_at, generated_arm, random_states, skewed_arm, track_arm

from geoimp_drake.arm.chain import chain_arrays
from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.arm.state import ArmState
from geoimp_drake.compilation.compiled import compiled, is_available
from geoimp_drake.laws.compositions.arm_quantities import arm_quantities, measured_motion
from geoimp_drake.laws.dynamics.serial_chain import (
    ChainArrays,
    chain_coriolis,
    chain_dynamics,
    chain_motion,
    chain_posture,
    chain_values,
)
from geoimp_drake.laws.redundancy.null_space_acceleration import coriolis_product

MODELS = {
    "six": generated_arm(6),
    "seven": generated_arm(7),
    "eight": generated_arm(8),
    "skewed": skewed_arm(),
    "track": track_arm(),
}
every_arm = pytest.mark.parametrize("name", MODELS)
needs_numba = pytest.mark.skipif(not is_available(), reason="numba is not installed")

RELATIVE = 1e-12  # to the largest entry

Laws = Callable[[Callable], Callable]

# Of an arm; not what a chain has found besides.
QUANTITIES = ArmState.__slots__[:-1]


def as_written(law: Callable) -> Callable:
    return law


both_forms = pytest.mark.parametrize(
    "form", [as_written, pytest.param(compiled, marks=needs_numba)], ids=["written", "compiled"]
)


def assert_same(value: np.ndarray, expected: np.ndarray, name: str = "") -> None:
    scale = np.abs(expected).max()
    np.testing.assert_allclose(value, expected, rtol=0, atol=RELATIVE * scale, err_msg=name)


def halves(state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    q, v = state.reshape(2, -1)
    return q, v


def whole_chain(chain: ChainArrays, state: np.ndarray, form: Laws) -> dict[str, np.ndarray]:
    """Returns everything that the laws of the chain say of a state."""
    q, v = halves(state)
    found, coriolis = chain_values(len(q)), np.zeros(len(q))
    form(chain_posture)(chain, q, found)
    form(chain_motion)(v, found)
    form(chain_dynamics)(chain, v, found)
    form(chain_coriolis)(v, found, coriolis)
    return {
        "R_WE": found.X_WE[:, :3],
        "p_WE": found.X_WE[:, 3],
        "V_WE": found.V_WE,
        "Jv_V_WE": found.J,
        "Jdot_v": found.Jdot_v,
        "B": found.B,
        "Cv": found.Cv,
        "g": found.g,
        "dB": found.dB,
        "coriolis": coriolis,
    }


def chain_christoffel(chain: ChainArrays, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Returns C(q, v), column by column."""
    found = chain_values(len(q))
    chain_posture(chain, q, found)

    def c(velocity: np.ndarray) -> np.ndarray:
        felt = np.zeros(len(q))
        chain_coriolis(velocity, found, felt)
        return felt

    return np.column_stack([coriolis_product(c, c(v), v, unit) for unit in np.eye(len(q))])


@both_forms
@every_arm
def test_kinematics_and_dynamics_are_those_of_drake(name: str, form: Laws) -> None:
    model = MODELS[name]
    chain = chain_arrays(model)
    for state in random_states(model, 5):
        ours, drakes = whole_chain(chain, state, form), arm_at(model, state)
        for quantity in ("R_WE", "p_WE", "V_WE", "Jv_V_WE", "Jdot_v", "B", "Cv", "g"):
            assert_same(ours[quantity], getattr(drakes, quantity), quantity)
        assert_same(ours["coriolis"], drakes.Cv)


@needs_numba
@every_arm
def test_compiled_they_are_the_same(name: str) -> None:
    model = MODELS[name]
    chain = chain_arrays(model)
    for state in random_states(model, 5):
        fast, plain = (whole_chain(chain, state, form) for form in (compiled, as_written))
        for quantity, expected in plain.items():
            assert_same(fast[quantity], expected, quantity)


@both_forms
@every_arm
def test_inertia_rate_is_exact(name: str, form: Laws) -> None:
    model = MODELS[name]
    chain, autodiff = chain_arrays(model), AutoDiffArm(model)
    for state in random_states(model, 5):
        ours = whole_chain(chain, state, form)["dB"]
        assert_same(ours, autodiff.inertia_rate(*halves(state)))
        np.testing.assert_array_equal(ours, ours.T)


@every_arm
def test_inertia_rate_and_coriolis_matrix_belong_together(name: str) -> None:
    """Ḃ − 2C is skew, C by polarisation of what `chain_coriolis` returns."""
    model = MODELS[name]
    chain = chain_arrays(model)
    for state in random_states(model, 5):
        C, dB = (
            chain_christoffel(chain, *halves(state)),
            whole_chain(chain, state, as_written)["dB"],
        )
        skew = dB - 2.0 * C
        np.testing.assert_allclose(skew + skew.T, 0.0, atol=1e-12 * np.abs(C).max())
        assert np.abs(skew).max() > 0.1 * np.abs(C).max()


@every_arm
def test_coriolis_matrix_is_that_of_christoffel(name: str) -> None:
    model = MODELS[name]
    chain, autodiff = chain_arrays(model), AutoDiffArm(model)
    q, v = halves(random_states(model, 1)[0])
    assert_same(chain_christoffel(chain, q, v), autodiff.christoffel_matrix(q, v))


@both_forms
@every_arm
def test_quantities_of_the_arm_are_those_of_the_arm_model(name: str, form: Laws) -> None:
    model = MODELS[name]
    dynamics = ChainDynamics(model)
    dynamics._quantities = partial(form(arm_quantities), chain_arrays(model))
    for state in random_states(model, 5):
        ours, drakes = dynamics.evaluate(None, state), arm_at(model, state)
        for quantity in QUANTITIES:
            assert_same(getattr(ours, quantity), getattr(drakes, quantity), quantity)


@both_forms
def test_measured_motion_is_told_by_a_reading_in_any_order(form: Laws) -> None:
    model = MODELS["seven"]
    law = partial(form(measured_motion), *ChainDynamics(model).arguments)
    rng = np.random.default_rng(3)
    order = np.append(rng.permutation(7), 7 + rng.permutation(7))
    for state in random_states(model, 5):
        reading = np.full(15, 2.0)  # with a count behind it, as `InnerLoop` holds one
        reading[order] = state
        drakes, motion = arm_at(model, state), np.full(19, np.nan)
        assert law(order, reading, motion)
        expected = np.concatenate((drakes.Q_WE, drakes.p_WE, drakes.V_WE, np.zeros(6)))
        assert_same(motion, expected)


@both_forms
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_reading_that_is_not_finite_tells_no_motion(form: Laws, bad: float) -> None:
    arm, motion = ChainDynamics(MODELS["six"]).arguments, np.zeros(19)
    for k in range(12):
        reading = np.zeros(12)
        reading[k] = bad
        assert not form(measured_motion)(*arm, np.arange(12), reading, motion)


def test_friction_and_reflected_inertia_are_those_of_the_joints() -> None:
    model = MODELS["eight"]
    chain = chain_arrays(model)
    np.testing.assert_allclose(chain.friction, 0.3 * np.arange(8), rtol=RELATIVE)
    # In a discrete plant's step friction is an inertia Δt F, too.
    implicit = 1e-3 * chain.friction
    np.testing.assert_allclose(chain.rotors, 0.36 + implicit, rtol=RELATIVE)
    np.testing.assert_array_equal(chain.turns, [0, 1, 1, 1, 1, 1, 1, 1])
    turns = chain_arrays(MODELS["skewed"]).turns
    np.testing.assert_array_equal(turns, [1, 1, 0, 1, 1, 0, 1, 1])


def test_a_wrong_arm_is_found() -> None:
    """Of the comparisons here: each constant of the arm reaches what is compared."""
    model = MODELS["skewed"]
    chain, state = chain_arrays(model), random_states(model, 1)[0]
    right = whole_chain(chain, state, as_written)
    for field in ("X_MF", "axes", "masses", "centres", "inertias", "X_ME", "rotors", "gravity"):
        value = getattr(chain, field).copy()
        value.flat[-1] += 1e-6
        wrong = whole_chain(chain._replace(**{field: value}), state, as_written)
        away = [np.abs(wrong[k] - right[k]).max() / np.abs(right[k]).max() for k in right]
        assert max(away) > 1e3 * RELATIVE, field
