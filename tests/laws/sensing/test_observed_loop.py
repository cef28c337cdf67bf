"""The sampled loop through a momentum observer: where it is stable, by arithmetic."""

from dataclasses import replace

import numpy as np
import pytest

from geoimp_drake.laws.sensing.observed_loop import ObservedLoop

T = 1e-3
ROBOT_LATE = {"acts_late": True, "believed_late": False}
OBSERVER_LATE = {"acts_late": False, "believed_late": True}


def loop(ratio: float, gain: float, slowness: float = 1e-3) -> ObservedLoop:
    """An arm that is so many times as heavy as its impedance; all but the observer is slow."""
    identity = np.eye(6)
    rates = slowness * np.array([20.0, 100.0, 65.0, 2000.0])
    return ObservedLoop(identity, ratio * identity, *np.multiply.outer(rates, identity), T, gain)


@pytest.mark.parametrize("gain", [50.0, 200.0, 1000.0])
@pytest.mark.parametrize(("late", "least"), [(ROBOT_LATE, 1.5), (OBSERVER_LATE, 2.0)])
def test_largest_ratio_of_masses_is_that_of_the_printed_bound(late, least, gain):
    bound = least + 1.0 / (gain * T)
    assert loop(0.99 * bound, gain).growth(**late) < 1.0 + 1e-6
    assert loop(1.01 * bound, gain).growth(**late) > 1.001


def test_of_a_direct_impedance_only_what_is_compliant_counts():
    """The rest follows D by the inner loop, which does not know of the observer."""
    whole = replace(loop(30.0, 100.0, 1.0), is_direct=True)
    assert whole.growth() > 1.5
    turns = np.diag([1.0] * 3 + [0.0] * 3)
    heavy = replace(whole, mass_inverse=0.5 * turns)
    assert heavy.growth() < 1.0
    assert replace(heavy, K_D=0.0 * turns, K_P=0.0 * turns).growth() == pytest.approx(1.0, abs=1e-6)


def test_axes_do_not_matter():
    rng = np.random.default_rng(0)
    turn, _ = np.linalg.qr(rng.normal(size=(6, 6)))
    straight = replace(loop(12.0, 200.0), mobility=np.diag([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))
    matrices = {
        name: turn @ getattr(straight, name) @ turn.T
        for name in ("mobility", "mass_inverse", "damping", "stiffness", "K_D", "K_P")
    }
    assert replace(straight, **matrices).growth() == pytest.approx(straight.growth(), rel=1e-9)
    assert straight.growth() > 1.0
