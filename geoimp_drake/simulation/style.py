"""One style for every figure; its style sheet is chapter.mplstyle beside this file."""

import io
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

__all__ = [
    "AXIS_STYLES",
    "figure_contents",
    "figure_files",
    "figure_style",
    "keep_noise_small",
    "shade_phases",
]

# By the kind of a figure's file its metadata: without a date, so that bytes repeat.
_KINDS: dict[str, dict[str, Any]] = {"png": {}, "pdf": {"CreationDate": None}}

# Colours for x, y, z; the dashes tell them apart without colour.
AXIS_STYLES: tuple[dict[str, Any], ...] = (
    {"color": "#D55E00", "linestyle": "-"},
    {"color": "#009E73", "linestyle": (0, (6, 2))},
    {"color": "#0072B2", "linestyle": (0, (2, 1))},
)
_PHASE_COLOURS = ("#00000008", "#00000014")
# How much higher an axis becomes for upright names, so that they stand above the curves.
_ROOM = 1.2
# Half of the least range that an axis shows, by the unit in its label.
_FLOORS = {"mm": 0.1, "m": 1e-4, "N": 0.1, "Nm": 0.01, "rad": 1e-3, "rad²": 1e-6, "-": 1e-3}


def figure_style() -> AbstractContextManager[None]:
    """Returns a context in which figures are drawn in this project's style."""
    return style.context(Path(__file__).with_name("chapter.mplstyle"))


def figure_files(*names: str) -> tuple[str, ...]:
    """Returns the names of the files of figures: NAME.png and, for print, NAME.pdf."""
    return tuple(f"{name}.{kind}" for name in names for kind in _KINDS)


def figure_contents(name: str, figure: Figure) -> Iterator[tuple[str, bytes]]:
    """Yields name and content of each file of a figure; each time the same bytes."""
    for file, (kind, metadata) in zip(figure_files(name), _KINDS.items(), strict=True):
        buffer = io.BytesIO()
        with figure_style():
            figure.savefig(buffer, format=kind, metadata=metadata)
        yield file, buffer.getvalue()


def keep_noise_small(axes: Axes) -> None:
    """Widens the range of an axis until what is below its quantity's floor looks like nothing."""
    unit = axes.get_ylabel().rpartition("[")[2].rstrip("]")
    low, high = axes.get_ylim()
    floor, middle = _FLOORS.get(unit, 0.0), (low + high) / 2
    if high - low < 2 * floor:
        axes.set_ylim(middle - floor, middle + floor)


def shade_phases(axes: Axes, phases: list[tuple[str, float, float]], *, label: bool) -> None:
    """Shades what is visible of a motion's phases; `label` writes their names.

    Many names are upright, and the axis is made higher for them.
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
