"""Damping designed with the inertia in view gives every mode its damping ratio."""

import numpy as np
import pytest
from law_numerics import assert_close, random_spd

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.impedance.damping_design import damping_for_ratio, natural_modes

LIGHT_AND_HEAVY = np.diag([1.0, 2.0, 40.0])


def poles(M, D, K):
    """The roots of det(s²M + sD + K)."""
    n = len(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    return np.linalg.eigvals(A)


def pairs(count=50):
    rng = np.random.default_rng(0)
    for _ in range(count):
        yield random_spd(rng, 0.5, 40.0), random_spd(rng, 50.0, 2000.0)


@pytest.mark.parametrize("zeta", [0.05, 0.4, 0.9])
def test_every_pole_has_the_damping_ratio(zeta):
    for M, K in pairs():
        found = poles(M, damping_for_ratio(M, K, zeta), K)
        assert_close(-found.real / np.abs(found), np.full(6, zeta), atol=1e-10)
        # Damping leaves the natural frequencies where they are.
        w, _ = natural_modes(M, K)
        assert_close(np.sort(np.abs(found)), np.repeat(w, 2), atol=1e-9 * w.max())


def test_overdamped_modes_have_the_real_poles_of_their_ratio():
    zeta = 1.7
    for M, K in pairs(10):
        w, _ = natural_modes(M, K)
        expected = np.concatenate([w * (-zeta + sign * np.sqrt(zeta**2 - 1)) for sign in (-1, 1)])
        found = np.sort_complex(poles(M, damping_for_ratio(M, K, zeta), K))
        assert_close(found, np.sort(expected), atol=1e-8 * w.max())


def test_damping_from_the_stiffness_alone_misses_the_ratio():
    """The property is not one that any reasonable damping has."""
    _, K = next(pairs(1))
    M, zeta = LIGHT_AND_HEAVY, 0.7
    values, U = np.linalg.eigh(K)
    naive = (U * (2.0 * zeta * np.sqrt(values * np.trace(M) / 3.0))) @ U.T
    found = poles(M, naive, K)
    ratios = -found.real / np.abs(found)
    assert ratios.max() - ratios.min() > 0.3


def test_modes_diagonalize_both_matrices():
    for M, K in pairs():
        w, A = natural_modes(M, K)
        assert (np.diff(w) >= 0.0).all()
        assert_close(A @ A.T, M, atol=1e-12 * M.max())
        assert_close((A * w**2) @ A.T, K, atol=1e-11 * K.max())


def test_damping_is_symmetric_positive_definite():
    for M, K in pairs():
        D = damping_for_ratio(M, K, 0.3)
        np.testing.assert_array_equal(D, D.T)
        assert np.linalg.eigvalsh(D)[0] > 0.0


def test_along_one_axis_it_is_two_zeta_root_m_k():
    assert_close(damping_for_ratio([[9.0]], [[700.0]], 0.7), [[1.4 * np.sqrt(6300.0)]], atol=1e-12)
    D = damping_for_ratio(np.diag([9.0, 9.0, 20.0]), np.diag([700.0, 900.0, 500.0]), 1.0)
    assert_close(D, np.diag(2.0 * np.sqrt([6300.0, 8100.0, 10000.0])), atol=1e-12)


def test_any_number_of_coordinates():
    rng = np.random.default_rng(1)
    B, C = rng.normal(size=(2, 6, 6))
    M, K = B @ B.T + np.eye(6), 100.0 * (C @ C.T + np.eye(6))
    found = poles(M, damping_for_ratio(M, K, 0.6), K)
    assert_close(-found.real / np.abs(found), np.full(12, 0.6), atol=1e-9)


@pytest.mark.parametrize(
    ("M", "K", "zeta", "message"),
    [
        (np.diag([1.0, -2.0, 3.0]), np.eye(3), 0.7, "M is not positive definite.* -2"),
        (np.eye(3), np.diag([1.0, 2.0]), 0.7, r"K has shape \(2, 2\)"),
        (np.eye(3), np.array([[2.0, 1.0], [0.0, 2.0]]), 0.7, "K has shape"),
        (np.eye(2), np.array([[2.0, 1.0], [0.0, 2.0]]), 0.7, "K is not symmetric"),
        (np.eye(3), np.full((3, 3), np.nan), 0.7, "K is .*finite"),
        (np.eye(3), np.eye(3), 0.0, "zeta is 0"),
        (np.eye(3), np.eye(3), np.nan, "zeta is nan"),
    ],
)
def test_unusable_matrices_are_refused_with_the_number(M, K, zeta, message):
    with pytest.raises(ConfigurationError, match=message):
        damping_for_ratio(M, K, zeta)
