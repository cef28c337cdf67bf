"""Stiffness by principal axes, and the coupled stiffness."""

import numpy as np
import pytest
from law_numerics import (
    assert_close,
    jacobian,
    random_rotvec,
    random_spd,
    rate_of_change,
    rotation_gradient,
)

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.impedance import coupled_stiffness, translational_impedance
from geoimp_drake.laws.impedance.principal_axes import principal_axes, stiffness_from_principal_axes
from geoimp_drake.rotations import quaternion

PRINTED_U = np.array(
    [[0.8047, -0.3106, 0.5059], [0.5059, 0.8047, -0.3106], [-0.3106, 0.5059, 0.8047]]
)
GAMMA = np.array([4.0, 1.0, 2.5])


def test_force_of_a_displacement_along_a_principal_axis_is_gamma_times_it():
    K = stiffness_from_principal_axes(PRINTED_U, GAMMA)
    for u, gamma in zip(PRINTED_U.T, GAMMA, strict=True):
        force = translational_impedance.elastic_force(0.01 * u, K)
        assert_close(force, gamma * 0.01 * u, atol=5e-6)


def test_printed_axes_give_a_stiffness_with_exactly_the_given_eigenvalues():
    K = stiffness_from_principal_axes(PRINTED_U, GAMMA)
    U, gamma = principal_axes(K)
    assert_close(gamma, np.sort(GAMMA), atol=1e-14)
    assert_close((U * gamma) @ U.T, K, atol=1e-14)
    np.testing.assert_array_equal(K, K.T)
    assert_close(K, PRINTED_U @ np.diag(GAMMA) @ PRINTED_U.T, atol=1e-3)


@pytest.mark.parametrize(
    ("U", "gamma", "message"),
    [
        (1.01 * PRINTED_U, GAMMA, r"UᵀU − I is 0\.02"),
        (np.full((3, 3), np.nan), GAMMA, "nan"),
        (PRINTED_U, [4.0, -1.0, 2.5], r"\[4\.0, -1\.0, 2\.5\]"),
        (PRINTED_U, [4.0, np.inf, 2.5], "inf"),
        (PRINTED_U[:2], GAMMA, r"\(2, 3\)"),
    ],
)
def test_unusable_principal_axes_are_refused_with_the_number(U, gamma, message):
    with pytest.raises(ConfigurationError, match=message):
        stiffness_from_principal_axes(U, gamma)


def coupled_cases(count=30):
    rng = np.random.default_rng(0)
    for _ in range(count):
        K_p, K_o = random_spd(rng, 300.0, 900.0), random_spd(rng, 2.0, 10.0)
        K_c = rng.normal(scale=8.0, size=(3, 3))
        Q_CD = quaternion.canonical(quaternion.exp(random_rotvec(rng, 3.0)))
        yield Q_CD, rng.normal(scale=0.1, size=3), K_p, K_o, K_c


def test_coupled_moment_is_the_gradient_of_the_potential():
    for Q_CD, dp_D, K_p, K_o, K_c in coupled_cases():
        gradient = rotation_gradient(
            lambda Q, a=(dp_D, K_p, K_o, K_c): coupled_stiffness.potential_energy(Q, *a), Q_CD
        )
        computed = coupled_stiffness.elastic_moment(Q_CD, dp_D, K_o, K_c)
        assert_close(computed, gradient, atol=1e-8)


def test_coupled_force_is_the_gradient_of_the_potential():
    for Q_CD, dp_D, K_p, K_o, K_c in coupled_cases():

        def energy(p, Q=Q_CD, K=(K_p, K_o, K_c)):
            return coupled_stiffness.potential_energy(Q, p, *K)

        gradient = jacobian(energy, dp_D, h=1e-4)
        computed = coupled_stiffness.elastic_force(Q_CD, dp_D, K_p, K_c)
        assert_close(computed, gradient, atol=1e-7)


def test_holding_wrench_in_W_does_the_work_of_the_coupled_spring_as_C_moves():
    """With Δp in D, no further term is needed: D rests, C moves anyhow."""
    rng = np.random.default_rng(1)
    for Q_CD, dp_D, K_p, K_o, K_c in coupled_cases():
        Q_WD = quaternion.exp(random_rotvec(rng, 3.0))
        R_WD, Q_WC = (
            quaternion.to_rotation(Q_WD),
            quaternion.product(Q_WD, quaternion.conjugate(Q_CD)),
        )
        w_WC, v_WC = rng.normal(size=(2, 3))

        def energy(t, Q_WC=Q_WC, w=w_WC, v=v_WC, p=dp_D, Q_WD=Q_WD, K=(K_p, K_o, K_c)):
            later = quaternion.product(quaternion.exp(w * t), Q_WC)
            dp = p - quaternion.to_rotation(Q_WD).T @ v * t
            return coupled_stiffness.potential_energy(quaternion.relative(later, Q_WD), dp, *K)

        moment_W = quaternion.to_rotation(Q_WC) @ coupled_stiffness.elastic_moment(
            Q_CD, dp_D, K_o, K_c
        )
        force_W = R_WD @ coupled_stiffness.elastic_force(Q_CD, dp_D, K_p, K_c)
        power = -moment_W @ w_WC - force_W @ v_WC
        assert power == pytest.approx(rate_of_change(energy), rel=1e-6, abs=1e-6)


def test_stiffness_matrix_is_the_linearised_coupled_spring():
    _, _, K_p, K_o, K_c = next(coupled_cases(1))

    def wrench(small):
        Q, dp = quaternion.exp(small[:3]), small[3:]
        moment = coupled_stiffness.elastic_moment(Q, dp, K_o, K_c)
        return np.concatenate([moment, coupled_stiffness.elastic_force(Q, dp, K_p, K_c)])

    columns = [rate_of_change(lambda d, e=e: wrench(d * e)) for e in np.eye(6)]
    expected = coupled_stiffness.stiffness_matrix(K_p, K_o, K_c)
    assert_close(np.array(columns).T, expected, atol=1e-6)


def test_coupling_that_makes_the_stiffness_indefinite_is_refused_with_its_eigenvalue():
    K_p, K_o = 700.0 * np.eye(3), 2.0 * np.eye(3)
    limit = np.sqrt(700.0 * 2.0)
    coupled_stiffness.check_positive_definite(K_p, K_o, 0.99 * limit * np.eye(3))
    smallest = np.linalg.eigvalsh([[2.0, 1.01 * limit], [1.01 * limit, 700.0]])[0]
    with pytest.raises(ConfigurationError, match=rf"eigenvalue is {smallest:.4g},"):
        coupled_stiffness.check_positive_definite(K_p, K_o, 1.01 * limit * np.eye(3))
