"""Which gains of the inner loop for which error: E off C, and where the loop is unstable.

python docs/validation/studies/design_against_error.py
"""

import logging
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.laws.prediction.sampled_loop import SampledLoop
from geoimp_drake.simulation.run import simulate
from geoimp_drake.simulation.style import figure_style, make_logarithmic

# Factors of K_P; K_D goes with the root, so that the damping ratio stays.
FACTORS = (0.25, 1.0, 4.0, 16.0, 64.0, 128.0)
ERRORS = {
    "links 10 % heavier": ("world.links.mass=1.1",),
    "Coulomb friction 2 %": ("world.links.mass=1.0", "world.joints.coulomb=0.02"),
    "heavier, torques 3 ms late": ("world.links.mass=1.1", "world.torque_delay=0.003"),
}
DURATION = 4.5  # motion, then rest [s]
LOST = 50.0  # farther off at rest, the loop is unstable [mm]
K_PP, K_DP, K_PO, K_DO = 2025.0, 65.0, 4500.0, 65.0


def scenario_of(factor: float, settings: tuple[str, ...] = ()) -> Any:
    """Returns `disturbance` with the gains of the inner loop multiplied."""
    root = np.sqrt(factor)
    gains = {"K_Pp": factor * K_PP, "K_Dp": root * K_DP, "K_Po": factor * K_PO, "K_Do": root * K_DO}
    given = [f"motion.{name}={value}" for name, value in gains.items()]
    return get_experiment("disturbance").scenario(
        (), (*given, f"duration={DURATION}", "limits=null", *settings)
    )


def off(factor: float, settings: tuple[str, ...]) -> float:
    """Returns how far E is from C at rest [mm]; NaN where that is not at rest."""
    experiment, scenario = get_experiment("disturbance"), scenario_of(factor, settings)
    setup = experiment.build(scenario)
    outcome = simulate(setup.diagram, scenario.simulator, DURATION, events=setup.events)
    log = setup.recorder.collect(outcome.context)
    offset = 1e3 * (log["six/motion_E"] - log["six/motion_C"])[:, 4:7]
    rest = np.linalg.norm(offset[log["t"] > DURATION - 0.5], axis=1)
    lost = outcome.failure is not None or not len(rest) or np.ptp(rest) > 1.0 or rest.max() > LOST
    return np.nan if lost else float(rest.mean())


def largest_factor() -> float:
    """Returns the factor from which on the predictor has the loop unstable, without an error."""
    loop = get_experiment("disturbance").build(scenario_of(1.0)).loop
    assert isinstance(loop, SampledLoop)
    low, high = 1.0, 1e6
    while high > 1.001 * low:
        middle = np.sqrt(low * high)
        tried = replace(loop, K_P=middle * loop.K_P, K_D=np.sqrt(middle) * loop.K_D)
        low, high = (middle, high) if tried.growth() <= 1.0 + 1e-6 else (low, middle)
    return float(low)


def figure_of(values: dict[str, list[float]], limit: float) -> Figure:
    """Returns the offset over the factor, and the predictor's limit."""
    with figure_style():
        figure = Figure(figsize=(6.2, 3.6), layout="constrained")
        axes = figure.subplots()
        for (error, row), marker in zip(values.items(), "os^", strict=True):
            axes.plot(FACTORS, row, marker=marker, label=error)
        first = next(iter(values.values()))[FACTORS.index(1.0)]
        inverse = [first / factor for factor in FACTORS]
        axes.plot(FACTORS, inverse, color="0.6", linestyle=":", label="in inverse proportion")
        axes.axvline(limit, color="k", linestyle="--", label="predictor: unstable from here on")
        make_logarithmic(axes, "x")
        make_logarithmic(axes, "y")
        axes.set_xlabel("K_P over that of the chapter; K_D with its root")
        axes.set_ylabel("E off C at rest [mm]")
        axes.legend()
    return figure


def main() -> None:
    """Prints the table and writes the figure beside the page."""
    logging.getLogger("drake").setLevel(logging.ERROR)
    limit = largest_factor()
    values = {error: [off(k, own) for k in FACTORS] for error, own in ERRORS.items()}
    print(f"predictor's limit: {limit:.0f}")
    print("| K_P times | " + " | ".join(f"{factor:g}" for factor in FACTORS) + " |")
    for error, row in values.items():
        cells = ("unstable" if np.isnan(value) else f"{value:.2g} mm" for value in row)
        print(f"| {error} | " + " | ".join(cells) + " |")
    figure = figure_of(values, limit)
    figure.savefig(Path(__file__).parents[1] / "design_against_error.png", dpi=150)


if __name__ == "__main__":
    main()
