"""Maps of the success of several hands over the same draws, and the forces."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from geoimp_drake.campaigns.sweep_figures import draw_samples
from geoimp_drake.simulation.style import figure_style
from geoimp_drake.typing import Array

__all__ = ["scale_figure"]

Rows = Sequence[Mapping[str, Any]]

_OFFSET, _ANGLE = "offset of the hole [mm]", "misalignment [°]"
_BINS, _LEAST = 4, 10  # of rates over a number, with at least so many samples each
_MOST = (2.83, 5.66)  # largest values of both, which the plan draws along two axes
_PEG = 17.0  # diameter [mm]
_PANELS: dict[str, Callable[[Mapping[str, Any]], float]] = {
    "play of the peg [mm]": lambda row: (1e3 * row["peg_hole.hole_diameter"] - _PEG) / 2,
    "friction [-]": lambda row: row["peg_hole.friction"],
    "speed [mm/s]": lambda row: 3.0 * row["program.constants.spd"],
    "tilt in the grasp [°]": lambda row: _size(row, "grasp.rotation_deg.0", "grasp.rotation_deg.1"),
}


def scale_figure(rows: Rows) -> Figure:
    """Returns one map of the success for each hand, and below the forces and the other draws.

    Args:
        rows: of samples without an error.
    """
    hands = dict.fromkeys(str(row["variant"]) for row in rows)
    samples = {hand: [_seen(row) for row in rows if row["variant"] == hand] for hand in hands}
    with figure_style():
        figure = Figure(figsize=(13.6, 6.6), layout="constrained")
        above, below = figure.subplots(2, max(len(hands), 1 + len(_PANELS)))
        for axes in above[len(hands) :]:
            axes.set_visible(False)
        _draw_maps(figure, above, samples)
        _draw_forces(below[0], samples)
        for axes, label in zip(below[1:], _PANELS, strict=False):
            _draw_rates(axes, samples, label)
        handles, labels = below[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(hands))
        figure.suptitle(f"peg in hole, {len(rows)} samples, the same draws for every hand")
    return figure


def _seen(row: Mapping[str, Any]) -> dict[str, Any]:
    """Returns a row with the sizes of the program's two errors, and the panels' numbers."""
    offset, angle = (
        _size(row, f"misplanned.{key}.0", f"misplanned.{key}.2")
        for key in ("offset", "rotation_deg")
    )
    panels = {label: of(row) for label, of in _PANELS.items()}
    return {**row, _OFFSET: 1e3 * offset, _ANGLE: angle, **panels}


def _size(row: Mapping[str, Any], *keys: str) -> float:
    return float(np.hypot(*(row[key] for key in keys)))


def _draw_maps(figure: Figure, panels: Sequence[Axes], samples: Mapping[str, Rows]) -> None:
    for axes, (hand, rows) in zip(panels, samples.items(), strict=False):
        mesh = draw_samples(axes, rows, (_OFFSET, _ANGLE))
        wins = np.mean([row["success"] for row in rows])
        axes.set_title(f"{hand}: {100 * wins:.0f} %", fontsize=9)
        axes.set_xlabel(_OFFSET)
        axes.set(xlim=(0.0, _MOST[0]), ylim=(0.0, _MOST[1]))
    panels[0].set_ylabel(_ANGLE)
    figure.colorbar(mesh, ax=panels[-1], label="success rate")


def _draw_forces(axes: Axes, samples: Mapping[str, Rows]) -> None:
    """Draws the share of a hand's samples that exceeds a force."""
    for hand, rows in samples.items():
        force = np.sort([row["peak_force"] for row in rows])
        axes.step(force, 1.0 - np.arange(len(force)) / len(force), label=hand)
    axes.set_xlabel("largest force [N]")
    axes.set_ylabel("share of samples above it")


def _draw_rates(axes: Axes, samples: Mapping[str, Rows], label: str) -> None:
    for hand, rows in samples.items():
        axes.plot(*_rates(rows, label), "o-", ms=3, label=hand)
    axes.set_xlabel(label)
    axes.set_ylabel("success rate")
    axes.set_ylim(0.0, 1.0)


def _rates(rows: Rows, label: str) -> Array:
    """Returns the centres of bins with equal numbers of samples, and their rates (2, bins)."""
    values, wins = (np.array([row[key] for row in rows], dtype=float) for key in (label, "success"))
    bins = np.array_split(np.argsort(values), max(1, min(_BINS, len(rows) // _LEAST)))
    return np.array([(values[chosen].mean(), wins[chosen].mean()) for chosen in bins]).T
