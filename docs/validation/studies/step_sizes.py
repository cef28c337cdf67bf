"""Compares step sizes on `plexiglas` and `consistency`: error against the finest run, and cost.

python docs/validation/studies/step_sizes.py
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from numpy.typing import NDArray

from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.rotations import quaternion
from geoimp_drake.simulation.run import simulate
from geoimp_drake.simulation.style import figure_style
from geoimp_drake.systems.frame_motion import QUATERNION

Signal = Callable[[dict[str, Any]], NDArray[np.float64]]

FINEST = "0.25 ms"
STEPS = (2.5e-4, 5e-4, 1e-3, 2e-3, 4e-3)  # [s]
PERIODS = ("plant.time_step", "sampling.period", "sensor.period", "simulator.max_step_size")
# At a step of 1 ms; the scenarios' own scheme is explicit_euler.
SCHEMES = ("runge_kutta2", "runge_kutta3")
CONTINUOUS = (
    "plant.time_step=0",
    "plant.contact_model=point",
    "simulator.integration_scheme=runge_kutta3",
    "simulator.use_error_control=true",
)


@dataclass(frozen=True)
class Case:
    """An experiment and what of its log is compared."""

    duration: float  # that is simulated [s]
    steady: tuple[float, float]  # from when to when it rests [s]
    signal: Signal
    unit: str
    continuous: bool  # a continuous plant has no hydroelastic contact here


def contact_force(log: dict[str, Any]) -> NDArray[np.float64]:
    """Returns the size of the contact force over time [N]."""
    return np.asarray(np.linalg.norm(log["six/wrench_true"][:, 3:], axis=1))


def turned(log: dict[str, Any]) -> NDArray[np.float64]:
    """Returns by how much the hand is turned from the desired orientation, over time [rad]."""
    pairs = zip(log["six/motion_E"][:, QUATERNION], log["six/motion_D"][:, QUATERNION], strict=True)
    return np.array([np.linalg.norm(quaternion.log(quaternion.relative(E, D))) for E, D in pairs])


CASES = {
    "plexiglas": Case(12.0, (11.5, 12.0), contact_force, "N", continuous=False),
    "consistency": Case(3.0, (0.95, 1.0), turned, "rad", continuous=True),
}


@dataclass(frozen=True)
class Row:
    """What one setting gave."""

    label: str
    steady: float
    peak: float
    cost: float  # wall over simulated time


def main(out: Path) -> None:
    """Runs everything, prints the tables and writes the figure."""
    with figure_style():
        figure = Figure(figsize=(9, 3.8), layout="constrained")
        panels = figure.subplots(1, 2)
        for axes, (name, case) in zip(panels, CASES.items(), strict=True):
            rows = study(name, case)
            print_table(name, case.unit, rows)
            draw(axes, name, rows)
        panels[0].legend(loc="lower left")
        figure.savefig(out)


def study(name: str, case: Case) -> list[Row]:
    """Runs an experiment with every setting; the finest comes first."""
    settings = {f"{1e3 * h:g} ms": tuple(f"{key}={h}" for key in PERIODS) for h in STEPS}
    for scheme in SCHEMES:
        settings[f"1 ms, {scheme}"] = (f"simulator.integration_scheme={scheme}",)
    if case.continuous:
        settings["continuous"] = CONTINUOUS
    rows = []
    for label, overrides in settings.items():
        experiment = get_experiment(name)
        chosen = (*overrides, "log_period=0.004", f"duration={case.duration}")
        scenario = experiment.scenario((), chosen)
        setup = experiment.build(scenario)
        start = time.perf_counter()
        outcome = simulate(setup.diagram, scenario.simulator, case.duration)
        wall = time.perf_counter() - start
        log = setup.recorder.collect(outcome.context)
        values, times = case.signal(log), log["t"]
        rests = (times >= case.steady[0]) & (times <= case.steady[1])
        rows.append(
            Row(label, float(values[rests].mean()), float(values.max()), wall / case.duration)
        )
    return rows


def errors(row: Row, rows: list[Row]) -> tuple[float, float]:
    """Returns the relative errors of steady value and peak against the finest run."""
    return abs(row.steady / rows[0].steady - 1.0), abs(row.peak / rows[0].peak - 1.0)


def print_table(name: str, unit: str, rows: list[Row]) -> None:
    """Prints a Markdown table."""
    print(f"\n| `{name}` | steady [{unit}] | peak [{unit}] | off | peak off | wall / simulated |")
    print("|---|---|---|---|---|---|")
    for row in rows:
        steady, peak = errors(row, rows)
        print(
            f"| {row.label} | {row.steady:.5f} | {row.peak:.5f} | {steady:.1e} | {peak:.1e} | "
            f"{row.cost:.2f} |"
        )


def draw(axes: Any, name: str, rows: list[Row]) -> None:
    """Draws error against cost."""
    compared = [row for row in rows if row.label != FINEST]
    cost = [row.cost for row in compared]
    steady, peak = np.array([errors(row, rows) for row in compared]).T
    axes.loglog(cost, steady, "o", color="#0072B2", label="steady value")
    axes.loglog(cost, peak, "^", color="#D55E00", label="peak")
    for row, low, high in zip(
        compared, np.minimum(steady, peak), np.maximum(steady, peak), strict=True
    ):
        below = row.label.endswith("runge_kutta3")  # it stands close to the other scheme
        axes.annotate(
            row.label.replace("runge_kutta", "RK"),
            (row.cost, low if below else high),
            xytext=(0, -14 if below else 6),
            textcoords="offset points",
            ha="center",
        )
    axes.margins(0.2)
    axes.set_xticks([0.125, 0.25, 0.5, 1.0, 2.0], labels=["0.125", "0.25", "0.5", "1", "2"])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlim(0.1, 2.1)
    axes.set_title(name)
    axes.set_xlabel("wall time over simulated time [-]")
    axes.set_ylabel("relative error against 0.25 ms [-]")


if __name__ == "__main__":
    main(Path(__file__).parents[1] / "step_sizes.png")
