"""Draws what `geoimp reproduce` has run in two simulators: three experiments over each other.

python docs/validation/studies/two_simulators.py results/reproduce
"""

import json
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS
from geoimp_drake.diagrams.experiments.simulators import SIMULATORS
from geoimp_drake.scenario.loading import read_yaml
from geoimp_drake.simulation.log_data import read_log
from geoimp_drake.simulation.style import figure_style

PAGE = Path(__file__).resolve().parents[1]
WAYS = {"drake": ("-", 2.6, 0.35), "mujoco": ((0, (2, 2)), 1.2, 1.0)}  # dash, width, opacity


def main(results: Path) -> None:
    """Draws the figure of the page, and prints the table."""
    with figure_style():
        figure = Figure(figsize=(9.0, 8.4), layout="constrained")
        for name, row in zip(SIMULATORS, figure.subplots(3, 2), strict=True):
            folder = results / f"{name}_two_simulators"
            for run in sorted(path.parent for path in folder.glob("*/log.npz")):
                draw(name, run, row)
            row[0].legend(loc="best")
            for claim in json.loads((folder / "comparison.json").read_text("utf-8"))["claims"]:
                value = f"{claim['value']:.2g} {claim['unit']}".strip()
                print(f"| `{name}` | {claim['claim']} | {value} | {claim['bound']} |")
        figure.savefig(PAGE / "two_simulators.png", dpi=110)


def draw(name: str, run: Path, row: np.ndarray) -> None:
    """Draws the curves of a run over those that are there."""
    experiment, log = EXPERIMENTS[name], read_log(run / "log.npz")
    scenario = experiment.scenario((read_yaml(run / "scenario.yaml"),))
    dash, width, alpha = WAYS[scenario.engine]
    family = scenario.impedance.orientation
    look = {"color": "C0" if family == "quaternion" else "C1", "alpha": alpha, "lw": width}
    curves = SIMULATORS[name].curves(log, scenario)
    for axes, (title, unit, values) in zip(row, curves, strict=True):
        axes.plot(log["t"], values, ls=dash, label=f"{scenario.engine}, {family}", **look)
        axes.set(title=f"{name}: {title}", ylabel=unit, xlabel="time [s]")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
