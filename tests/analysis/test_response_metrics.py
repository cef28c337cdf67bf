"""Each metric that others publish, on a signal whose value is known by hand."""

import numpy as np
import pytest

from geoimp_drake.analysis.response_metrics import (
    force_overshoot,
    ideal_response,
    impedance_fidelity,
    impedance_power,
    jerk,
    root_mean_square,
    time_above,
)

TIMES = np.linspace(0.0, 4.0, 4001)


def test_the_root_mean_square_of_a_sine_is_its_amplitude_over_root_two():
    whole = TIMES[:-1]
    assert root_mean_square(3.0 * np.sin(2.0 * np.pi * whole)) == pytest.approx(3.0 / np.sqrt(2.0))


def test_overshoot_is_the_peak_over_the_force_of_the_last_second():
    force = np.where(TIMES < 2.0, 15.0, 12.0)
    assert force_overshoot(TIMES, force) == pytest.approx(0.25)
    assert force_overshoot(TIMES, np.minimum(force, 12.0)) == pytest.approx(0.0)
    # Whoever has left the wall at the end has overshot by more than any number.
    assert force_overshoot(TIMES, np.where(TIMES < 2.0, 15.0, 0.0)) == np.inf


def test_time_above_counts_every_stay_beyond_the_limit_and_not_the_limit_itself():
    force = np.full_like(TIMES, 20.0)
    force[(TIMES > 1.0) & (TIMES < 1.5)] = 21.0
    force[(TIMES > 3.0) & (TIMES < 3.25)] = 50.0
    assert time_above(TIMES, force, 20.0) == pytest.approx(0.75, abs=5e-3)
    assert time_above(TIMES, force, 30.0) == pytest.approx(0.25, abs=5e-3)
    assert time_above(TIMES, force, 50.0) == 0.0


def test_jerk_of_an_oscillation_is_amplitude_times_cube_of_the_frequency():
    omega, direction = 5.0, np.array([0.6, 0.0, 0.8])
    acceleration = -0.02 * omega**2 * np.outer(np.sin(omega * TIMES), direction)
    values = jerk(TIMES, acceleration)
    assert values.max() == pytest.approx(0.02 * omega**3, rel=1e-4)
    assert root_mean_square(values) == pytest.approx(0.02 * omega**3 / np.sqrt(2.0), rel=0.03)


def test_the_ideal_response_to_a_step_is_that_of_the_textbook():
    # Underdamped along x: f/K (1 − e^(−ζωt)(cos ω_d t + ζ/√(1−ζ²) sin ω_d t)); overdamped along y.
    M, D, K = np.diag([2.0, 1.0, 1.0]), np.diag([8.0, 30.0, 2.0]), np.diag([200.0, 125.0, 1.0])
    force = np.tile([20.0, 10.0, 0.0], (len(TIMES), 1))
    x, v = ideal_response(TIMES, force, M, D, K)
    omega, zeta = 10.0, 0.2
    root = np.sqrt(1.0 - zeta**2)
    decay, angle = np.exp(-zeta * omega * TIMES), omega * root * TIMES
    textbook = 0.1 * (1.0 - decay * (np.cos(angle) + zeta / root * np.sin(angle)))
    np.testing.assert_allclose(x[:, 0], textbook, atol=2e-6)
    slow, fast = 5.0, 25.0  # poles of s² + 30 s + 125
    two = (fast * np.exp(-slow * TIMES) - slow * np.exp(-fast * TIMES)) / (fast - slow)
    np.testing.assert_allclose(x[:, 1], 0.08 * (1.0 - two), atol=2e-6)
    np.testing.assert_allclose(v[1:-1], np.gradient(x, TIMES, axis=0)[1:-1], atol=1e-4)
    assert not x[:, 2].any()


def test_fidelity_is_the_root_mean_square_of_the_power_that_is_off():
    ideal = np.sin(2.0 * np.pi * TIMES[:-1])
    assert impedance_fidelity(ideal, ideal) == 0.0
    assert impedance_fidelity(0.9 * ideal, ideal) == pytest.approx(0.1 / np.sqrt(2.0))
    assert impedance_fidelity(1.1 * ideal, ideal) == pytest.approx(0.1 / np.sqrt(2.0))
    assert impedance_fidelity(ideal + 3.0, ideal) == pytest.approx(3.0)


def test_springs_and_dampers_give_the_power_that_the_mass_takes_in_an_ideal_step():
    M, D, K = 10.0 * np.eye(3), np.diag([134.0, 90.0, 60.0]), np.diag([800.0, 400.0, 200.0])
    force = np.tile([80.0, 20.0, -10.0], (len(TIMES), 1))
    x, v = ideal_response(TIMES, force, M, D, K)
    power = impedance_power(x - np.linalg.solve(K, force[0]), v, D, K)
    kinetic = 0.5 * np.sum(v * (v @ M.T), axis=1)
    np.testing.assert_allclose(power[1:-1], np.gradient(kinetic, TIMES)[1:-1], atol=0.01)
    # What is at rest away from its equilibrium is given nothing yet.
    assert power[0] == 0.0
