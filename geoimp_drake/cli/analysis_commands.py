"""The commands that analyze an experiment before a run."""

import argparse
import json
from pathlib import Path

from geoimp_drake.cli.commands import SUCCESS, named_in, print_files, scenario_of

__all__ = ["analyze"]

_FILE, _FIGURE = "analysis.json", "ringing"


def analyze(options: argparse.Namespace) -> int:
    """Prints on which walls an experiment's gains ring. Returns the exit status."""
    from geoimp_drake.analysis.maps import ringing_figure
    from geoimp_drake.analysis.report import analyze as analyzed
    from geoimp_drake.analysis.report import loop_of
    from geoimp_drake.analysis.ringing import delayed, on_surface
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment
    from geoimp_drake.output_folder import check_folder, write_files
    from geoimp_drake.simulation.style import figure_contents, figure_files

    experiment = get_experiment(options.experiment or named_in(options.scenario))
    scenario = scenario_of(experiment, options, None, options.seed)
    name = experiment.name if options.experiment else options.scenario.stem
    out = options.out or Path("results") / f"{name}-analysis"
    check_folder(out, [_FILE, *figure_files(_FIGURE)])
    loop = delayed(loop_of(experiment.build(scenario, logged=False)), options.delay)
    if options.surface_stiffness is not None:
        loop = on_surface(loop, options.surface_stiffness)
    analysis = analyzed(loop)
    print(f"{name}: {analysis}")
    figure = ringing_figure(loop, analysis, name)
    told = json.dumps(analysis.as_dict(), indent=2) + "\n"
    print_files(write_files(out, [(_FILE, told), *figure_contents(_FIGURE, figure)]))
    return SUCCESS
