"""One style for every figure; its style sheet is chapter.mplstyle beside this file."""

import io
from collections.abc import Iterator
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure

__all__ = [
    "AXIS_STYLES",
    "figure_contents",
    "figure_files",
    "figure_style",
    "keep_noise_small",
    "make_logarithmic",
    "shade_phases",
]

# Metadata of a figure's file, by its kind: without a date, so that the bytes repeat.
_KINDS: dict[str, dict[str, Any]] = {"png": {}, "pdf": {"CreationDate": None}}

# Colours for x, y, z; the dashes tell them apart without colour.
AXIS_STYLES: tuple[dict[str, Any], ...] = (
    {"color": "#D55E00", "linestyle": "-"},
    {"color": "#009E73", "linestyle": (0, (6, 2))},
    {"color": "#0072B2", "linestyle": (0, (2, 1))},
)
_PHASE_COLOURS = ("#00000008", "#00000014")
# The factor by which an axis becomes higher for upright names, so that they stand above the curves.
_ROOM = 1.2
# A logarithmic axis that spans less than this factor may show only one power of ten.
_FEW = 50.0
# Powers of ten up to this one are written out.
_PLAIN = 3
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# Half of the least range that an axis shows, by the unit in its label.
_FLOORS = {"mm": 0.1, "m": 1e-4, "N": 0.1, "Nm": 0.01, "rad": 1e-3, "rad²": 1e-6, "-": 1e-3}


def figure_style() -> AbstractContextManager[None]:
    """Returns a context in which figures are drawn in this project's style."""
    return style.context(Path(__file__).with_name("chapter.mplstyle"))


def figure_files(*names: str) -> tuple[str, ...]:
    """Returns the names of figures' files: NAME.png and, for print, NAME.pdf."""
    return tuple(f"{name}.{kind}" for name in names for kind in _KINDS)


def figure_contents(name: str, figure: Figure) -> Iterator[tuple[str, bytes]]:
    """Yields name and content of each file of a figure; the bytes are the same each time."""
    for file, (kind, metadata) in zip(figure_files(name), _KINDS.items(), strict=True):
        buffer = io.BytesIO()
        with figure_style():
            figure.savefig(buffer, format=kind, metadata=metadata)
        figure.set_layout_engine("none")  # all files have the first one's layout, computed once
        yield file, buffer.getvalue()


def make_logarithmic(axes: Axes, *names: str) -> None:
    """Makes `x`, `y` or both logarithmic, with plain numbers: this style draws no formulas."""
    for name in names:
        axes.set(**{f"{name}scale": "log"})
        axis: Axis = {"x": axes.xaxis, "y": axes.yaxis}[name]
        axis.set_major_formatter(lambda x, _: _power(x))
        axis.set_minor_formatter(partial(_between, axis))


def _power(x: float) -> str:
    """Returns the text of a power of ten."""
    exponent = round(np.log10(x))
    return f"{x:g}" if abs(exponent) <= _PLAIN else "10" + str(exponent).translate(_RAISED)


def _between(axis: Axis, x: float, _: object) -> str:
    """Returns the text of a tick between two powers of ten, where powers alone would be too few."""
    low, high = axis.get_view_interval()
    return f"{x:g}" if high < _FEW * low and f"{x:e}"[0] in "25" else ""


def keep_noise_small(axes: Axes) -> None:
    """Widens the range of an axis, so that values below its quantity's floor look like nothing."""
    unit = axes.get_ylabel().rpartition("[")[2].rstrip("]")
    low, high = axes.get_ylim()
    floor, middle = _FLOORS.get(unit, 0.0), (low + high) / 2
    if high - low < 2 * floor:
        axes.set_ylim(middle - floor, middle + floor)


def shade_phases(axes: Axes, phases: list[tuple[str, float, float]], *, label: bool) -> None:
    """Shades the visible part of a motion's phases; `label` writes their names.

    If there are many names, they stand upright, and the axis becomes higher.
    """
    first, last = axes.get_xlim()
    upright = len(phases) > 3
    if label and upright:
        low, high = axes.get_ylim()
        axes.set_ylim(low, low + _ROOM * (high - low))
    for index, (name, begin, end) in enumerate(phases):
        begin, end = max(begin, first), min(end, last)
        if begin >= end:
            continue
        axes.axvspan(begin, end, color=_PHASE_COLOURS[index % 2], linewidth=0)
        if label:
            axes.annotate(
                name,
                (begin if upright else (begin + end) / 2, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(2, -2) if upright else (0, -2),
                textcoords="offset points",
                ha="left" if upright else "center",
                va="top",
                rotation=90 if upright else 0,
                fontsize=8,
                color="#666666",
            )
