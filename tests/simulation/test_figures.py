"""Panels of figures: what their axes show at least."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from geoimp_drake.campaigns.sweep_figures import success_map
from geoimp_drake.simulation.figures import interaction_figure, panels_figure
from geoimp_drake.simulation.style import figure_contents, figure_style, make_logarithmic

T = np.linspace(0.0, 1.0, 50)
NOISE = 1e-15 * np.random.default_rng(0).standard_normal((50, 3))


def limits(values: np.ndarray, least: float | None, label: str = "f [N]") -> tuple[float, float]:
    panel = ("signal", label, values, least)
    (axes,) = panels_figure({"t": T}, "arm", [panel], "title", []).axes
    return axes.get_ylim()


@pytest.mark.parametrize(
    ("values", "expected"), [(NOISE, (-2.0, 2.0)), (np.abs(NOISE[:, 0]), (0.0, 2.0))]
)
def test_noise_does_not_look_like_a_signal(values: np.ndarray, expected: tuple) -> None:
    assert limits(values, 2.0) == expected
    # By default a force's floor holds.
    np.testing.assert_allclose(limits(values, None), (-0.1, 0.1), atol=1e-9)


@pytest.mark.parametrize(
    ("label", "floor"),
    [("Δp_dc [mm]", 0.1), ("μ [Nm]", 0.01), ("φ_dc [rad]", 1e-3), ("ᶜε_dc [-]", 1e-3)],
)
def test_each_quantity_has_a_floor(label: str, floor: float) -> None:
    np.testing.assert_allclose(limits(NOISE, None, label), (-floor, floor), atol=1e-9)
    low, high = limits(10 * floor + 0.1 * floor * NOISE / np.abs(NOISE).max(), None, label)
    np.testing.assert_allclose((low, high), (9 * floor, 11 * floor), rtol=0.05)


def test_the_figure_of_ones_own_experiment_has_floors_too() -> None:
    rest = np.zeros((50, 19))
    log = {
        "t": T,
        "arm/motion_D": rest,
        "arm/motion_C": rest,
        "arm/wrench": np.hstack((NOISE, NOISE)),
    }
    log["arm/motion_C"] = rest + NOISE[:, :1]
    figure = interaction_figure(
        log, "arm", NOISE, title="still", orientation_label="ᶜε_dc [-]", phases=[]
    )
    spans = [np.ptp(axes.get_ylim()) for axes in figure.axes]
    np.testing.assert_allclose(spans, [0.2, 0.002, 0.2, 0.02], rtol=1e-6)


def test_a_signal_is_shown_whole() -> None:
    values = np.outer(np.sin(6.0 * T), [1.0, 5.0, -9.0])
    low, high = limits(values, 2.0)
    assert low < values.min()
    assert high > values.max()
    assert (low, high) == limits(values, None)


def named_figure(name: str) -> Figure:
    motion = np.zeros((50, 19))
    log = {"t": T, "arm/motion_D": motion, "arm/motion_C": motion, "arm/wrench": motion[:, :6]}
    labels = {"title": name, "orientation_label": name, "phases": [(name, 0.0, 1.0)]}
    return interaction_figure(log, "arm", NOISE, **labels)


def named_map(name: str) -> Figure:
    row = {name: 1.0, "y": 2.0, "error": None, "success": True}
    return success_map([row, {**row, name: 2.0}], (name, "y"), name)


@pytest.mark.parametrize("figure", [named_figure, named_map])
@pytest.mark.parametrize("name", [r"$\frac{$", "$x^2$", r"a \$ b $ c", "50 %", "<b>", "{", "\\"])
def test_a_name_is_drawn_as_it_is_written(figure, name) -> None:
    drawn = figure(name)
    assert all(content for _, content in figure_contents("figure", drawn))
    texts = [text for text in drawn.findobj(Text) if name in text.get_text()]
    assert texts
    # Else the name would be taken for a formula.
    assert not any(text.get_parse_math() for text in texts)


@pytest.mark.parametrize("last", [30, 49])
def test_spans_in_which_a_limit_acts_are_shaded(last: int) -> None:
    limited = np.zeros((50, 10))
    limited[10:20, 2] = limited[25 : last + 1, 3] = 1.0
    limited[40:45, 5] = 1.0  # a slack alone is none
    log = {"t": T, "arm/limited": limited}
    panel = ("signal", "f [N]", NOISE, None)
    (axes,) = panels_figure(log, "arm", [panel], "title", []).axes
    spans = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in axes.patches]
    ends = [(T[10], T[20]), (T[25], T[min(last + 1, 49)])]
    np.testing.assert_allclose(spans, ends)
    names = [text.get_text() for text in axes.get_legend().get_texts()]
    assert names == ["x", "y", "z", "at a limit"]  # the legend's, which nothing stands over
    assert not axes.texts


@pytest.mark.parametrize(
    ("ends", "shown"),
    [
        ((0.3, 2e6), ["1", "10", "100", "1000", "10⁴", "10⁵", "10⁶"]),
        ((2e-5, 0.2), ["10⁻⁴", "0.001", "0.01", "0.1"]),
        ((0.4, 3.0), ["0.5", "1", "2"]),
    ],
)
def test_logarithmic_axes_have_plain_numbers(ends, shown):
    """The style reads no formulas, and matplotlib would write powers of ten as some."""
    with figure_style():
        axes = Figure().subplots()
        axes.plot(ends, (1.0, 1e4))
        make_logarithmic(axes, "x", "y")
        axes.set_xlim(ends)
        axes.figure.draw_without_rendering()
    ticks = [*axes.xaxis.get_ticklabels(), *axes.xaxis.get_ticklabels(minor=True)]
    low, high = ends
    seen = {
        label.get_position()[0]: label.get_text()
        for label in ticks
        if low <= label.get_position()[0] <= high and label.get_text()
    }
    assert [seen[x] for x in sorted(seen)] == shown
    assert not any("$" in label.get_text() for label in axes.yaxis.get_ticklabels())
