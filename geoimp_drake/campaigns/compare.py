"""Several runs of one experiment, drawn over each other and judged together."""

import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.output_folder import check_folder, write_files
from geoimp_drake.simulation.claims import Claim
from geoimp_drake.simulation.experiment import RUN_FILES, run_experiment
from geoimp_drake.simulation.style import (
    figure_contents,
    figure_files,
    figure_style,
    keep_noise_small,
)
from geoimp_drake.typing import Array

__all__ = ["COMPARISON_FILES", "Runs", "compare_families", "compare_runs", "comparison_figure"]

# Log and scenario by the run's name.
Runs = Mapping[str, tuple[dict[str, Array], Any]]

COMPARISON_FILES = ("comparison.json", *figure_files("comparison"))

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
        The claims of each family, the claims across families, the files that were written, and the
        errors that stopped simulations by family.

    Raises:
        ConfigurationError: a scenario or the folder cannot be used; nothing has been written.
    """
    scenarios = {family: scenario_of(family) for family in families}
    check_folder(
        out, [*(f"{family}/{file}" for family in families for file in RUN_FILES), *COMPARISON_FILES]
    )
    results = {
        family: run_experiment(experiment, scenario, out / family)
        for family, scenario in scenarios.items()
    }
    runs = {family: (result.log, scenarios[family]) for family, result in results.items()}
    across, files = compare_runs(experiment.name, comparison, runs, out, "orientation families")
    return (
        {family: result.claims for family, result in results.items()},
        across,
        [path for result in results.values() for path in result.files] + files,
        {
            family: result.failure
            for family, result in results.items()
            if result.failure is not None
        },
    )


def compare_runs(
    name: str, comparison: Any, runs: Runs, out: Path, kind: str
) -> tuple[list[Claim], list[Path]]:
    """Writes the figure of several runs, and comparison.json with the claims across them.

    Args:
        name: of the experiment.
        comparison: its curves and claims across runs.
        runs: those to compare.
        out: folder to write into.
        kind: their difference, in words.

    Returns:
        The claims, and the files that were written.
    """
    claims = comparison.claims(runs)
    data = {
        "experiment": name,
        "compared": list(runs),
        "claims": [claim.as_dict() for claim in claims],
    }
    text = json.dumps(data, indent=2, ensure_ascii=False) + "\n"
    figure = comparison.figure or partial(comparison_figure, name, comparison, kind=kind)
    drawn = figure_contents("comparison", figure(runs))
    return claims, write_files(out, [("comparison.json", text), *drawn])


def comparison_figure(
    name: str, comparison: Any, runs: Runs, kind: str = "orientation families"
) -> Figure:
    """Returns one panel a quantity, one curve a run.

    Args:
        name: of the experiment.
        comparison: its curves.
        runs: those to compare.
        kind: their difference, in words.
    """
    with figure_style():
        panels = {run: comparison.curves(*runs[run]) for run in runs}
        first = next(iter(panels.values()))
        figure = Figure(figsize=(4.5 * len(first), 3.6))
        for index, axes in enumerate(np.atleast_1d(figure.subplots(1, len(first)))):
            for k, (run, curves) in enumerate(panels.items()):
                values = curves[index][2]
                axes.plot(runs[run][0]["t"], values, label=run, linestyle=_DASHES[k % len(_DASHES)])
            title, label, _ = first[index]
            axes.set_title(title)
            axes.set_ylabel(label)
            axes.set_xlabel("time [s]")
            axes.set_xlim(left=0.0)
            keep_noise_small(axes)
            axes.set_ylim(bottom=0.0)
        axes.legend(loc="best")
        figure.suptitle(f"{name}: {kind} compared")
    return figure
