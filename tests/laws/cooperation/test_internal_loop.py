"""Which gains of the internal impedance hold a stiff grasp in a sampled loop."""

import numpy as np
import pytest

from geoimp_drake.laws.cooperation.internal_loop import (
    growth_rate,
    least_damping,
    least_mass,
    relative_inertia,
)

STIFFNESS = {"translation": 2000.0, "rotation": 100.0}
MOTION = {"translation": (2025.0, 65.0), "rotation": (4500.0, 65.0)}
PARTS = pytest.mark.parametrize("part", STIFFNESS)


def rate(part: str, inertia: float, mass: float, damping: float, period: float = 1e-3) -> float:
    gains = np.array([mass, damping, STIFFNESS[part]]).reshape(3, 1, 1)
    motion = np.array(MOTION[part]).reshape(2, 1)
    return growth_rate(np.array([[inertia]]), gains, motion, period)


def test_hands_heavier_than_twice_the_mass_are_thrown_about() -> None:
    """As in the rigid grasp of the bar: 9.4 kg are held with 5 kg and not with 3 kg."""
    assert rate("translation", 1.9 * 10.0, 10.0, 400.0) < -20.0
    assert rate("translation", 2.1 * 10.0, 10.0, 400.0) > 50.0


@PARTS
def test_the_worst_of_light_hands_is_held_up_to_the_mass_of_the_formula(part: str) -> None:
    K, (K_P, K_D), D = STIFFNESS[part], MOTION[part], 0.1 * STIFFNESS[part]
    limit = (np.sqrt(K) + np.sqrt(D * K_D)) ** 2 / K_P
    worst = 1e-3 * np.sqrt(D * K / K_D)
    assert rate(part, worst, 0.9 * limit, D) < 0.0 < rate(part, worst, 1.1 * limit, D)
    others = worst * np.array([0.3, 3.0])
    assert max(rate(part, inertia, 0.9 * limit, D) for inertia in others) < 0.0


def test_the_hands_of_two_light_arms_ring_with_the_gains_for_heavy_ones() -> None:
    """iiwas turn about 4 g m² against each other; 0.3 kg m² and 12 Nms/rad are for 100 g m²."""
    assert rate("rotation", 0.1, 0.3, 12.0) < -20.0
    assert rate("rotation", 0.0043, 0.3, 12.0) > 0.0


@PARTS
@pytest.mark.parametrize("period", [5e-4, 1e-3, 4e-3])
@pytest.mark.parametrize("heaviest", [1e-4, 0.01, 1.0, 100.0])
def test_gains_for_the_heaviest_direction_hold_all_lighter_ones(part, period, heaviest) -> None:
    K, (K_P, K_D) = STIFFNESS[part], MOTION[part]
    M = least_mass(heaviest, K, K_D, period)
    D = least_damping(M, K, K_P, K_D)
    inertias = heaviest * np.geomspace(1e-3, 1.5, 30)
    assert max(rate(part, inertia, M, D, period) for inertia in inertias) < 0.0


def test_ten_times_the_inertia_asks_for_ten_times_the_mass() -> None:
    K_D = 65.0
    light, heavy = (least_mass(inertia, 2000.0, K_D, 1e-3) for inertia in (5.0, 50.0))
    assert heavy == pytest.approx(10.0 * light)
    assert light == pytest.approx(10.0 * (1.0 + K_D * 1e-3))


def test_inertias_of_both_hands_against_each_other_are_in_series() -> None:
    """Two bodies of 3 and 6 kg have 2 kg against each other."""
    J, B = np.eye(6), np.diag([0.1, 0.1, 0.1, 1.0, 1.0, 1.0])
    together = relative_inertia(J, 3.0 * B, J, 6.0 * B)
    np.testing.assert_allclose(together, 2.0 * B, rtol=1e-12)
