"""Draws the usable region of the internal impedance from the tables of two sweeps.

STUDIES=docs/validation/studies
geoimp sweep bar --scenario $STUDIES/internal_impedance.yaml \
        --plan $STUDIES/internal_impedance_plan.yaml --out results/internal
geoimp sweep bar --scenario $STUDIES/internal_impedance.yaml \
        --plan $STUDIES/internal_impedance_light_plan.yaml --out results/internal_light
python $STUDIES/internal_impedance.py results/internal/samples.csv \
        results/internal_light/samples.csv
"""

import csv
import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from geoimp_drake.simulation.style import figure_style

Values = NDArray[np.float64]

MASS, DAMPING, STIFFNESS = (
    f"internal.translation.{name}" for name in ("mass", "damping", "stiffness")
)
STEADY, PEAK = 12.0, 30.0  # bounds of the internal force [N]
ERROR, GRASP = 5e-3, 5e4  # of the base [m], and the grasp's stiffness [N/m]
STEP = 1e-3  # [s] of control
GOOD, BAD, GREY = "#0072B2", "#D55E00", "#666666"


def main(stiffness_table: Path, mass_table: Path, out: Path) -> None:
    """Reads both tables and writes the figure."""
    with figure_style():
        figure = Figure(figsize=(10, 4.2), layout="constrained")
        left, right = figure.subplots(1, 2)
        _draw_stiffness(left, _rows(stiffness_table))
        _draw_mass(right, _rows(mass_table))
        figure.savefig(out)


def _rows(table: Path) -> list[dict[str, str]]:
    with table.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _column(rows: list[dict[str, str]], key: str) -> Values:
    return np.array([float(row[key] or "nan") for row in rows])


def _usable(rows: list[dict[str, str]]) -> NDArray[np.bool_]:
    # The experiment's own success has the bounds of what is left and of ringing.
    success = np.array([row["success"] == "True" for row in rows])
    return np.asarray(success & (_column(rows, "largest_squeeze") <= PEAK))


def _draw_stiffness(axes: Any, rows: list[dict[str, str]]) -> None:
    """What stiffness leaves of the force, and what it peaks at."""
    K = _column(rows, STIFFNESS)
    line = np.linspace(0.0, K.max(), 100)
    axes.plot(
        line, ERROR * line * GRASP / (line + GRASP), color=GREY, label="K and the grasp in series"
    )
    axes.plot(K, _column(rows, "steady_squeeze"), "o", color=GOOD, label="at the end")
    axes.plot(K, _column(rows, "largest_squeeze"), "^", color=BAD, mfc="none", label="largest")
    for bound in (STEADY, PEAK):
        axes.axhline(bound, color=GREY, linewidth=0.8, linestyle=":")
    axes.set_xlabel("K [N/m]")
    axes.set_ylabel("internal force [N]")
    axes.set_title("what is left of 159 N")
    axes.legend()


def _draw_mass(axes: Any, rows: list[dict[str, str]]) -> None:
    """Which masses and dampings come to rest, at K = 2000 N/m."""
    M, D, usable = _column(rows, MASS), _column(rows, DAMPING), _usable(rows)
    refused = np.array([bool(row["error"]) for row in rows])
    for chosen, marker, colour, label in (
        (usable, "o", GOOD, "usable"),
        (~usable & ~refused, "x", BAD, "rings or diverges"),
        (refused, "+", GREY, "refused"),
    ):
        if chosen.any():
            axes.plot(M[chosen], D[chosen], marker, color=colour, label=label)
    line = np.linspace(0.0, M.max(), 2)
    for ratio in (0.5, 1.0, 1.5):
        axes.plot(line, ratio * line / STEP, color=GREY, linewidth=0.8, linestyle=":")
        axes.annotate(
            f"D Δt/M = {ratio:g}",
            (min(M.max(), 4e3 * STEP / ratio), min(ratio * M.max() / STEP, 4e3)),
            ha="right",
            fontsize="small",
        )
    axes.set_xlim(0.0, 1.3 * M.max())  # leaves room for the legend
    axes.set_ylim(0.0, 4.4e3)
    axes.set_xlabel("M [kg]")
    axes.set_ylabel("D [Ns/m]")
    axes.set_title("damping of a light mutual motion, K = 2000 N/m")
    axes.legend(loc="lower right")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:3]), Path(__file__).parents[1] / "internal_impedance.png")
