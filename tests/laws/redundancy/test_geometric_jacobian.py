"""J̇, Ḃ and J̇† are derivatives: compared with AutoDiff through the plant itself."""

import numpy as np
import pytest
from autodiff_arm import AutoDiffArm, derivative
from pydrake.autodiffutils import AutoDiffXd, ExtractValue
from pydrake.math import inv
from redundant_arms import arm_at, generated_arm, random_states, track_arm

from geoimp_drake.arm.derivatives import coriolis_forces, inertia_rate
from geoimp_drake.laws.redundancy.geometric_jacobian import jacobian_adjoint, jacobian_rate
from geoimp_drake.laws.redundancy.null_space_acceleration import coriolis_product
from geoimp_drake.laws.redundancy.pseudo_inverse import (
    null_space_projector,
    pseudo_inverse_rate,
    weighted_pseudo_inverse,
)

MODELS = {
    "six": generated_arm(6),
    "seven": generated_arm(7),
    "eight": generated_arm(8),
    "track": track_arm(),
}
every_arm = pytest.mark.parametrize("name", MODELS)


def halves(state: np.ndarray) -> np.ndarray:
    return state.reshape(2, -1)


@every_arm
def test_jacobian_rate_is_exact(name: str) -> None:
    model = MODELS[name]
    autodiff = AutoDiffArm(model)
    for state in random_states(model, 5):
        J, _ = autodiff.along(*halves(state))
        ours = jacobian_rate(arm_at(model, state).Jv_V_WE, halves(state)[1])
        np.testing.assert_allclose(ours, derivative(J), rtol=0, atol=1e-13)


@every_arm
def test_jacobian_rate_of_a_frame_on_a_link_in_the_middle(name: str) -> None:
    model = MODELS[name]
    link = model.plant.get_body(model.plant.get_frame(model.end_effector.index()).body().index())
    middle = "link3"
    assert middle != link.name()
    q, v = halves(random_states(model, 1)[0])
    J, _ = AutoDiffArm(model, middle).along(q, v)
    ours = jacobian_rate(ExtractValue(J).reshape(J.shape), v)
    np.testing.assert_allclose(ours, derivative(J), rtol=0, atol=1e-13)


@every_arm
def test_jacobian_adjoint_is_the_adjoint_of_the_jacobian_rate(name: str) -> None:
    model = MODELS[name]
    rng = np.random.default_rng(1)
    for state in random_states(model, 5):
        J, v = arm_at(model, state).Jv_V_WE, halves(state)[1]
        G = rng.standard_normal(J.shape)
        expected = (G * jacobian_rate(J, v)).sum()
        assert (J * jacobian_adjoint(J, G)).sum(axis=0) @ v == pytest.approx(expected, abs=1e-12)


@every_arm
def test_inertia_rate_agrees_with_autodiff(name: str) -> None:
    model = MODELS[name]
    autodiff, scratch = AutoDiffArm(model), model.plant.CreateDefaultContext()
    for state in random_states(model, 5):
        q, v = halves(state)
        _, B = autodiff.along(q, v)
        ours = inertia_rate(model, scratch, q, v)
        scale = np.abs(ExtractValue(B)).max()
        np.testing.assert_allclose(ours, derivative(B), rtol=0, atol=1e-10 * scale)
        np.testing.assert_array_equal(model.plant.GetPositions(scratch), q)


@every_arm
@pytest.mark.parametrize("weight", ["inertia", "constant"])
def test_pseudo_inverse_rate_agrees_with_autodiff(name: str, weight: str) -> None:
    model = MODELS[name]
    autodiff, scratch = AutoDiffArm(model), model.plant.CreateDefaultContext()
    n = model.num_joints
    for state in random_states(model, 5):
        q, v = halves(state)
        J_autodiff, W_autodiff = autodiff.along(q, v)
        arm = arm_at(model, state)
        J, W, dW = arm.Jv_V_WE, arm.B, inertia_rate(model, scratch, q, v)
        if weight == "constant":
            W, dW = np.diag(np.arange(1.0, n + 1)), np.zeros((n, n))
            W_autodiff = np.vectorize(AutoDiffXd)(W)
        W_inverse_Jt = inv(W_autodiff) @ J_autodiff.T
        expected = derivative(W_inverse_Jt @ inv(J_autodiff @ W_inverse_Jt))
        W_inverse = np.linalg.inv(W)
        J_pinv = weighted_pseudo_inverse(J, W_inverse)
        N = null_space_projector(J, J_pinv)
        ours = pseudo_inverse_rate(J_pinv, N, jacobian_rate(J, v), W, W_inverse, dW)
        np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


@every_arm
def test_coriolis_product_is_that_of_the_christoffel_matrix(name: str) -> None:
    model = MODELS[name]
    autodiff, scratch = AutoDiffArm(model), model.plant.CreateDefaultContext()
    n = model.num_joints
    state = random_states(model, 1)[0]
    (q, v), e = halves(state), np.random.default_rng(2).standard_normal(n)
    C = autodiff.christoffel_matrix(q, v)
    model.plant.SetPositions(scratch, q)

    def c(velocity: np.ndarray) -> np.ndarray:
        return coriolis_forces(model, scratch, velocity)

    np.testing.assert_allclose(coriolis_product(c, c(v), v, e), C @ e, rtol=0, atol=1e-10)
