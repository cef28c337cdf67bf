"""Modes from poles."""

import numpy as np
import pytest

from geoimp_drake.laws.prediction.modes import modes_of, second_order_poles


def test_modes_are_those_of_the_textbook() -> None:
    """Two axes: ω = 10 with ζ = 0.3, and an overdamped one that falls apart into two."""
    M_inv, D, K = np.diag([0.5, 1.0]), np.diag([12.0, 101.0]), np.diag([200.0, 100.0])
    modes = modes_of(second_order_poles(M_inv, D, K))
    assert [mode.frequency for mode in modes] == pytest.approx([1.0, 10.0, 100.0])
    assert [mode.damping_ratio for mode in modes] == pytest.approx([1.0, 0.3, 1.0])
    assert [mode.time_constant for mode in modes] == pytest.approx([1.0, 1 / 3, 0.01])
    assert [mode.ringing for mode in modes] == pytest.approx([0.0, 10 * np.sqrt(0.91), 0.0])


def test_growing_mode_has_negative_damping() -> None:
    (mode,) = modes_of(np.array([2.0 + 1.0j, 2.0 - 1.0j]))
    assert mode.damping_ratio == pytest.approx(-2 / np.sqrt(5))
    assert mode.time_constant == pytest.approx(-0.5)
