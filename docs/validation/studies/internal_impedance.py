"""Draws the usable region of the internal impedance from the table of a sweep.

geoimp sweep bar --scenario docs/validation/studies/internal_impedance.yaml \
        --plan docs/validation/studies/internal_impedance_plan.yaml --out results/internal
python docs/validation/studies/internal_impedance.py results/internal/samples.csv
"""

import csv
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.simulation.style import figure_style

KEYS = [f"internal.translation.{name}" for name in ("mass", "damping", "stiffness")]
STEADY = 12.0  # [N] that the internal force may keep
STEP = 1e-3  # [s] of control


def main(table: Path, out: Path) -> None:
    """Reads the table and writes the figure."""
    with table.open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if not row["error"]]
    M, D, K = (np.array([float(row[key]) for row in rows]) for key in KEYS)
    steady = np.array([float(row["steady_squeeze"]) for row in rows])
    usable = np.array([row["success"] == "True" for row in rows])
    with figure_style():
        figure = Figure(figsize=(9, 3.8))
        left, right = figure.subplots(1, 2)
        for chosen, marker, label in ((usable, "o", "usable"), (~usable, "x", "not usable")):
            left.scatter(K[chosen], D[chosen], c=_colour(chosen is usable), marker=marker)
            ratio = D[chosen] * STEP / M[chosen]
            right.scatter(
                ratio, steady[chosen], c=_colour(chosen is usable), marker=marker, label=label
            )
        left.set_xlabel("K [N/m]")
        left.set_ylabel("D [Ns/m]")
        left.set_title("stiffness and damping")
        right.axhline(STEADY, color="#666666", linewidth=0.8, linestyle=":")
        right.set_xlabel("D Δt/M [-]")
        right.set_ylabel("internal force at the end [N]")
        right.set_yscale("log")
        right.set_title("what is left of 159 N")
        right.legend()
        figure.savefig(out)


def _colour(usable: bool) -> str:
    return "#0072B2" if usable else "#D55E00"


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(__file__).parents[1] / "internal_impedance.png")
