"""The laws take Drake's AutoDiffXd: derivatives by AutoDiff equal finite differences."""

import numpy as np
import pytest
from law_numerics import (
    assert_close,
    every_family,
    jacobian,
    random_family,
    random_moment,
    random_spd,
)
from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff

from geoimp_drake.laws.impedance import coupled_stiffness, translational_impedance
from geoimp_drake.laws.impedance.families import FAMILIES
from geoimp_drake.laws.motion_control.inverse_dynamics import inverse_dynamics
from geoimp_drake.laws.motion_control.orientation_control import orientation_law
from geoimp_drake.laws.motion_control.position_control import position_acceleration

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def assert_derivatives_agree(function, x):
    result = np.atleast_1d(function(InitializeAutoDiff(x).flatten()))
    by_autodiff = ExtractGradient(result.reshape(-1, 1))
    expected = np.atleast_2d(jacobian(lambda x: np.atleast_1d(function(x)), x))
    scale = max(1.0, np.abs(expected).max())
    assert_close(by_autodiff, expected, atol=1e-7 * scale)


def split(x):
    return x[:4], x[4:7], x[7:10], x[10:14], x[14:17], x[17:20]


def state(seed):
    moment = random_moment(np.random.default_rng(seed), 1.0)
    return np.concatenate(moment.law_input())


def test_comparison_of_derivatives_notices_a_lost_one():
    with pytest.raises(AssertionError):
        assert_derivatives_agree(lambda x: x * (x[0] if x.dtype == float else 1.0), np.ones(2))


@every_family
def test_angular_acceleration(name):
    family = random_family(name, np.random.default_rng(0))
    assert_derivatives_agree(lambda x: family.angular_acceleration(*split(x)), state(1))


@every_family
def test_energies_powers_and_moments(name):
    family = random_family(name, np.random.default_rng(0))

    def outputs(x):
        Q_WD, w_WD, _, Q_WC, w_WC, mu_W = split(x)
        motion = Q_WD, w_WD, Q_WC, w_WC
        scalars = [
            family.kinetic_energy(*motion),
            family.potential_energy(Q_WD, Q_WC),
            family.dissipated_power(*motion),
            family.supplied_power(*motion, mu_W),
        ]
        return np.concatenate([family.elastic_moment_W(Q_WD, Q_WC), scalars])

    assert_derivatives_agree(outputs, state(2))


@every_family
def test_zero_displacement_has_derivatives(name):
    family = random_family(name, np.random.default_rng(0))
    x = state(3)
    x[10:14] = x[:4]
    assert_derivatives_agree(lambda x: family.elastic_moment(x[:4], x[10:14]), x)


@pytest.mark.parametrize("name", list(FAMILIES))
def test_orientation_control(name):
    K_D, K_P = 65.0 * np.eye(3), 4500.0 * np.eye(3)
    law = orientation_law(name)
    assert_derivatives_agree(lambda x: law(*split(x)[:5], K_D, K_P), state(4))


def test_translation():
    rng = np.random.default_rng(5)
    M, D, K = (random_spd(rng, 1.0, 10.0) for _ in range(3))

    def outputs(x):
        a, dv, dp, f = x.reshape(4, 3)
        scalars = [
            translational_impedance.kinetic_energy(dv, M),
            translational_impedance.potential_energy(dp, K),
            translational_impedance.dissipated_power(dv, D),
            translational_impedance.supplied_power(dv, f),
        ]
        return np.concatenate(
            [
                translational_impedance.compliant_acceleration(a, dv, dp, f, M, D, K),
                position_acceleration(a, dv, dp, D, K),
                scalars,
            ]
        )

    assert_derivatives_agree(outputs, rng.normal(size=12))


def test_coupled_stiffness():
    rng = np.random.default_rng(6)
    K_p, K_o, K_c = (random_spd(rng, 1.0, 10.0) for _ in range(3))

    def outputs(x):
        Q, dp = x[:4], x[4:]
        return np.concatenate(
            [
                coupled_stiffness.elastic_moment(Q, dp, K_o, K_c),
                coupled_stiffness.elastic_force(Q, dp, K_p, K_c),
                [coupled_stiffness.potential_energy(Q, dp, K_p, K_o, K_c)],
            ]
        )

    assert_derivatives_agree(outputs, rng.normal(size=7))


def test_inverse_dynamics():
    rng = np.random.default_rng(7)
    B, J = rng.normal(size=(6, 6)), rng.normal(size=(6, 6))

    def tau(x):
        alpha, Cv, Fv, g, h = x.reshape(5, 6)
        return inverse_dynamics(B, alpha, Cv, Fv, g, J, h)

    assert_derivatives_agree(tau, rng.normal(size=30))
