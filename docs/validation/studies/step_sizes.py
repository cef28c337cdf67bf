"""Compares step sizes on `plexiglas` and `consistency`: error against the finest run, and cost.

python docs/validation/studies/step_sizes.py
"""

import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.simulation.run import simulate
from geoimp_drake.simulation.style import figure_style

STEPS = (5e-4, 1e-3, 2e-3, 4e-3)  # [s]
PERIODS = ("plant.time_step", "sampling.period", "sensor.period", "simulator.max_step_size")
CONTINUOUS = (
    "plant.time_step=0",
    "plant.contact_model=point",
    "simulator.integration_scheme=runge_kutta3",
    "simulator.use_error_control=true",
)
# Of each experiment the time that is simulated [s] and what is looked at in its log.
CASES = {"plexiglas": (12.0, slice(3, 6), "force [N]"), "consistency": (3.0, slice(0, 3), "[Nm]")}


def main(out: Path) -> None:
    """Runs everything, prints the table and writes the figure."""
    with figure_style():
        figure = Figure(figsize=(9, 3.6))
        panels = figure.subplots(1, 2)
        for axes, (name, (duration, part, unit)) in zip(panels, CASES.items(), strict=True):
            rows = study(name, duration, part)
            finest = rows[0]
            print(f"| {name} | steady {unit} | peak {unit} | off | peak off | real time |")
            for label, steady, peak, wall in rows:
                off, peak_off = abs(steady / finest[1] - 1.0), abs(peak / finest[2] - 1.0)
                print(
                    f"| {label} | {steady:.4f} | {peak:.4f} | {off:.1e} | {peak_off:.1e} | "
                    f"{duration / wall:.2f} × |"
                )
                if label != finest[0]:
                    axes.loglog(wall / duration, off, "o", color="#0072B2")
                    axes.loglog(wall / duration, peak_off, "x", color="#D55E00")
                    axes.annotate(label, (wall / duration, max(off, peak_off)))
            axes.set_title(name)
            axes.set_xlabel("wall time over simulated time [-]")
            axes.set_ylabel("error: steady (dots), peak (crosses) [-]")
        figure.savefig(out)


def study(name: str, duration: float, part: slice) -> list[tuple[str, float, float, float]]:
    """Returns label, steady value, peak and wall time [s] of each setting."""
    settings = {f"{1e3 * h:g} ms": tuple(f"{key}={h}" for key in PERIODS) for h in STEPS}
    if name == "consistency":  # with hydroelastic contact there is no continuous plant
        settings["continuous"] = CONTINUOUS
    rows = []
    for label, overrides in settings.items():
        experiment = get_experiment(name)
        scenario = experiment.scenario((), (*overrides, "log_period=0.02", f"duration={duration}"))
        setup = experiment.build(scenario)
        start = time.perf_counter()
        outcome = simulate(setup.diagram, scenario.simulator, duration)
        wall = time.perf_counter() - start
        log = setup.recorder.collect(outcome.context)
        size = np.linalg.norm(log["six/wrench_true"][:, part], axis=1)
        rows.append((label, float(size[-10:].mean()), float(size.max()), wall))
    return rows


if __name__ == "__main__":
    main(Path(__file__).parents[1] / "step_sizes.png")
