"""The figures of a sweep: where it succeeds, and how large the forces become."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from geoimp_drake.simulation.style import figure_style
from geoimp_drake.typing import Array

__all__ = ["draw_samples", "peaks_figure", "success_map"]

Rows = Sequence[Mapping[str, Any]]

_MARK, _FEW = 42.0, 100  # area of a mark, for up to so many samples

# Colour-blind-safe, and told apart by their shapes too.
_OUTCOMES: dict[str, dict[str, Any]] = {
    "succeeds": {"color": "#0072B2", "marker": "o", "edgecolors": "white", "linewidths": 0.6},
    "does not succeed": {
        "color": "#D55E00",
        "marker": "X",
        "edgecolors": "white",
        "linewidths": 0.6,
    },
    "error": {"color": "#000000", "marker": "+"},
}


def success_map(rows: Rows, keys: Sequence[str], title: str) -> Figure:
    """Returns the samples over two columns, and behind them the success rate by cell.

    Args:
        rows: of the sweep's table.
        keys: the columns along x and along y.
        title: of the figure; the success rate is added.
    """
    x, y = keys
    with figure_style():
        figure = Figure(figsize=(6.4, 4.8))
        axes = figure.subplots()
        mesh = draw_samples(axes, rows, keys)
        figure.colorbar(mesh, ax=axes, label="success rate in the cell")
        axes.set_xlabel(x)
        axes.set_ylabel(y)
        axes.set_title(f"{title}: {_rate(rows)}")
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3)
    return figure


def draw_samples(axes: Axes, rows: Rows, keys: Sequence[str]) -> QuadMesh:
    """Draws the same into axes, smaller marks for more samples; returns the cells.

    Args:
        axes: to draw into.
        rows: of the sweep's table, not empty.
        keys: the columns along x and along y.
    """
    x, y = keys
    mesh = _draw_rates(axes, rows, x, y)
    size = min(_MARK, _MARK * _FEW / len(rows))
    for name, style in _OUTCOMES.items():
        chosen = [row for row in rows if _outcome(row) == name]
        if chosen:
            axes.scatter(
                _column(chosen, x), _column(chosen, y), label=name, s=size, clip_on=False, **style
            )
    return mesh


def peaks_figure(rows: Rows, title: str) -> Figure:
    """Returns histograms of the largest true forces and moments.

    Args:
        rows: of the sweep's table.
        title: of the figure.
    """
    with figure_style():
        figure = Figure(figsize=(8.4, 3.4))
        panels = (("peak_force", "largest force [N]"), ("peak_moment", "largest moment [Nm]"))
        for axes, (column, label) in zip(figure.subplots(1, 2), panels, strict=True):
            _draw_histogram(axes, rows, column)
            axes.set_xlabel(label)
            axes.set_ylabel("samples")
        figure.suptitle(f"{title}: {_rate(rows)}")
    return figure


def _draw_rates(axes: Axes, rows: Rows, x: str, y: str) -> QuadMesh:
    """Fills cells with the share of their samples that succeed; about four samples a cell."""
    size = max(1, round(np.sqrt(len(rows) / 4)))
    values, success = (_column(rows, x), _column(rows, y)), _column(rows, "success")
    counts, x_edges, y_edges = np.histogram2d(*values, bins=size)
    wins, _, _ = np.histogram2d(*values, bins=(x_edges, y_edges), weights=success)
    rates = np.divide(wins, counts, out=np.full_like(counts, np.nan), where=counts > 0)
    return axes.pcolormesh(x_edges, y_edges, rates.T, cmap="cividis", vmin=0, vmax=1, alpha=0.45)


def _draw_histogram(axes: Axes, rows: Rows, column: str) -> None:
    """Draws all samples that ran to their end, and over them those that succeed."""
    whole = [row for row in rows if row["error"] is None]
    values = _finite(whole, column)
    if not values.size:
        return
    edges = np.histogram_bin_edges(values, bins=20).tolist()
    failing, succeeding = _OUTCOMES["does not succeed"]["color"], _OUTCOMES["succeeds"]["color"]
    axes.hist(values, edges, color=failing, hatch="//", label="does not succeed")
    wins = _finite([row for row in whole if row["success"]], column)
    axes.hist(wins, edges, color=succeeding, label="succeeds")
    axes.legend()


def _finite(rows: Rows, column: str) -> Array:
    values = _column(rows, column)
    return values[np.isfinite(values)]


def _column(rows: Rows, name: str) -> Array:
    return np.array([row[name] for row in rows], dtype=float)


def _outcome(row: Mapping[str, Any]) -> str:
    if row["error"] is not None:
        return "error"
    return "succeeds" if row["success"] else "does not succeed"


def _rate(rows: Rows) -> str:
    wins = sum(row["success"] for row in rows)
    return f"{wins} of {len(rows)} succeed ({100 * wins / len(rows):.0f} %)"
