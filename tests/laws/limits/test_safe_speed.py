"""The speed from which an impact is safe, against the law's own two-mass equation; the leash."""

import numpy as np
import pytest

from geoimp_drake.laws.limits.safe_speed import leashed, safe_speed

N = np.array([0.0, 0.6, 0.8])
RNG = np.random.default_rng(5)


def peak(speed: float, mass: float, damping: float, stiffness: float) -> float:
    """Returns the largest force on a clamped spring that D drags C into, both at a speed."""
    step, c, v, most = 1e-6, 0.0, speed, 0.0
    for _ in range(int(np.pi / np.sqrt(stiffness / mass) / step)):
        v += step * (damping * (speed - v) - stiffness * c) / mass
        c += step * v
        most = max(most, stiffness * c)
    return most


@pytest.mark.parametrize(("damping", "stiffness"), [(2000.0, 7.5e4), (180.0, 2.5e4), (0.0, 1.5e5)])
def test_a_clamped_impact_at_the_speed_stays_below_the_force(damping, stiffness):
    M, mobility = 9.0 * np.eye(3), 2.0 * np.eye(3)
    v = safe_speed(N, 150.0, stiffness, mobility, M, damping * np.eye(3))
    force = peak(v, 9.0, damping, stiffness)
    assert 60.0 < force <= 150.1
    # By the mass that the arm itself shows the speed would be too high.
    naive = 150.0 / np.sqrt(0.5 * stiffness)
    assert peak(naive, 9.0, damping, stiffness) > 1.5 * 150.0


def test_the_larger_mass_counts_and_a_lost_direction_has_no_speed():
    light, heavy = np.eye(3) / 0.7, np.eye(3) / 40.0
    M, D = 9.0 * np.eye(3), np.zeros((3, 3))
    assert safe_speed(N, 150.0, 1e4, light, M, D) == pytest.approx(150.0 / np.sqrt(9.0e4))
    assert safe_speed(N, 150.0, 1e4, heavy, M, D) == pytest.approx(150.0 / np.sqrt(40.0e4))
    assert safe_speed(N, 150.0, 1e4, np.zeros((3, 3)), M, D) == 0.0


def test_a_leash_keeps_the_direction_and_pulls_no_more_than_it_may():
    for _ in range(100):
        A = RNG.normal(size=(3, 3))
        G, x = 100.0 * (A @ A.T + np.eye(3)), RNG.normal(size=3)
        held = leashed(x, G, 75.0)
        assert np.linalg.norm(G @ held) == pytest.approx(75.0)
        np.testing.assert_allclose(np.cross(held, x), 0.0, atol=1e-12)
        np.testing.assert_array_equal(leashed(1e-3 * held, G, 75.0), 1e-3 * held)
