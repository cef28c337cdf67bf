"""Panels of figures: what their axes show at least."""

import numpy as np
import pytest

from geoimp_drake.simulation.figures import panels_figure

T = np.linspace(0.0, 1.0, 50)
NOISE = 1e-15 * np.random.default_rng(0).standard_normal((50, 3))


def limits(values: np.ndarray, least: float | None) -> tuple[float, float]:
    panel = ("force", "f [N]", values, least)
    (axes,) = panels_figure({"t": T}, "arm", [panel], "title", []).axes
    return axes.get_ylim()


@pytest.mark.parametrize(
    ("values", "expected"), [(NOISE, (-2.0, 2.0)), (np.abs(NOISE[:, 0]), (0.0, 2.0))]
)
def test_noise_does_not_look_like_a_signal(values: np.ndarray, expected: tuple) -> None:
    assert limits(values, 2.0) == expected
    low, high = limits(values, None)
    assert max(abs(low), abs(high)) < 1e-13


def test_a_signal_is_shown_whole() -> None:
    values = np.outer(np.sin(6.0 * T), [1.0, 5.0, -9.0])
    low, high = limits(values, 2.0)
    assert low < values.min()
    assert high > values.max()
    assert (low, high) == limits(values, None)
