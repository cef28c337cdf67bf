"""Several orientation families on one scenario, drawn over each other."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.simulation.claims import Claim
from geoimp_drake.simulation.experiment import FileWriter, run_experiment
from geoimp_drake.simulation.style import figure_style
from geoimp_drake.typing import Array

__all__ = ["compare_families", "comparison_figure"]

_DASHES = ("-", (0, (6, 2)), (0, (2, 1)), (0, (6, 2, 2, 2)))


def compare_families(
    experiment: Any,
    comparison: Any,
    scenario_of: Callable[[str], Any],
    families: Sequence[str],
    out: Path,
) -> tuple[dict[str, list[Claim]], list[Claim], list[Path], dict[str, Exception]]:
    """Runs each family into its own folder below `out`, and compares them.

    Args:
        experiment: of the catalogue.
        comparison: the experiment's curves and claims across families.
        scenario_of: makes the scenario of a family.
        families: names of orientation families.
        out: folder to write into.

    Returns:
        The claims of each family, the claims across families, the files that were written, and
        what stopped a family's simulation, by family.
    """
    scenarios = {family: scenario_of(family) for family in families}
    results = {
        family: run_experiment(experiment, scenario, out / family)
        for family, scenario in scenarios.items()
    }
    runs = {family: (result.log, scenarios[family]) for family, result in results.items()}
    writer = FileWriter(out)
    figure = comparison_figure(experiment.name, comparison, runs)
    writer.write("comparison.png", lambda path: figure.savefig(path, format="png"))
    return (
        {family: result.claims for family, result in results.items()},
        comparison.claims(runs),
        [path for result in results.values() for path in result.files] + writer.files,
        {
            family: result.failure
            for family, result in results.items()
            if result.failure is not None
        },
    )


def comparison_figure(
    name: str, comparison: Any, runs: dict[str, tuple[dict[str, Array], Any]]
) -> Figure:
    """Returns one panel a quantity, one curve a family.

    Args:
        name: of the experiment.
        comparison: its curves.
        runs: log and scenario by family.
    """
    with figure_style():
        panels = {family: comparison.curves(*run) for family, run in runs.items()}
        first = next(iter(panels.values()))
        figure = Figure(figsize=(4.5 * len(first), 3.6))
        for index, axes in enumerate(np.atleast_1d(figure.subplots(1, len(first)))):
            for k, (family, curves) in enumerate(panels.items()):
                values = curves[index][2]
                axes.plot(
                    runs[family][0]["t"],
                    values,
                    label=family,
                    linestyle=_DASHES[k % len(_DASHES)],
                )
            title, label, _ = first[index]
            axes.set_title(title)
            axes.set_ylabel(label)
            axes.set_xlabel("time [s]")
            axes.set_xlim(left=0.0)
            axes.set_ylim(bottom=0.0)
        axes.legend(loc="best")
        figure.suptitle(f"{name}: orientation families compared")
    return figure
