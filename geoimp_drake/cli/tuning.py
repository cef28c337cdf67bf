"""The command `geoimp tune`."""

import argparse
import os
from pathlib import Path
from typing import Any

from geoimp_drake.cli.commands import SUCCESS, named_in, print_files, scenario_of
from geoimp_drake.cli.options import add_experiment, add_scenario_options

__all__ = ["add_tune", "tune"]


def add_tune(subparsers: Any) -> None:
    """Adds the command to the parser."""
    parser = subparsers.add_parser(
        "tune",
        help="find gains that press more gently and do not ring",
        description="Runs the experiment once, searches M, D or K of the translation on a fast "
        "rollout of the law against its wall, and runs what it found. Where the rollout is off by "
        "more than 10 %, the search goes on in runs of the experiment. Writes tuned.yaml, a "
        "scenario for `geoimp run`, tuning.json and figures.",
    )
    add_experiment(parser)
    parser.add_argument(
        "--minimize",
        action="append",
        metavar="METRIC",
        help="peak_force, settling or steady_force (peak_force); of several, also with commas, the "
        "Pareto front is drawn",
    )
    parser.add_argument(
        "--subject-to",
        action="append",
        metavar="METRIC<NUMBER",
        help="a constraint, < or >, also on largest_surface_stiffness; may be repeated (the force "
        "rests when D does)",
    )
    parser.add_argument(
        "--surface-stiffness",
        metavar="LOW:HIGH",
        help="of walls that have to be met as well, and up to which nothing may ring [N/m] (up to "
        "5 times the surface's)",
    )
    parser.add_argument(
        "--vary",
        action="append",
        metavar="GAIN[=LOW:HIGH]",
        help="M, D or K along the wall's normal, with bounds; also with commas (D,M)",
    )
    parser.add_argument("--plan", type=Path, metavar="FILE", help="YAML file with all of these")
    parser.add_argument(
        "--evaluations", type=int, metavar="N", help="of the rollout in a search (300)"
    )
    parser.add_argument(
        "--runs", type=int, metavar="N", help="of the experiment at most, if need be (24)"
    )
    parser.add_argument("--jobs", type=int, metavar="J", help="processes for them (one a core)")
    add_scenario_options(parser)
    parser.set_defaults(command=tune)


def tune(options: argparse.Namespace) -> int:
    """Finds better gains for an experiment. Returns the exit status."""
    from geoimp_drake.campaigns.fastest_form import fastest_form
    from geoimp_drake.campaigns.tuning import tune as tuned
    from geoimp_drake.campaigns.tuning_files import TUNING_FILES, format_tuning, write_tuning
    from geoimp_drake.campaigns.tuning_plan import TuningPlan
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment
    from geoimp_drake.output_folder import check_folder

    experiment = get_experiment(options.experiment or named_in(options.scenario))
    names = "minimize", "subject_to", "surface_stiffness", "vary", "seed", "evaluations", "runs"
    plan = TuningPlan.read(options.plan, **{name: getattr(options, name) for name in names})
    scenario = scenario_of(experiment, options, None, None, fastest_form())
    name = experiment.name if options.experiment else options.scenario.stem
    out = options.out or Path("results") / f"tune-{name}"
    check_folder(out, TUNING_FILES)
    jobs = (os.cpu_count() or 1) if options.jobs is None else options.jobs
    result = tuned(experiment, scenario, plan, out, jobs=jobs)
    print(format_tuning(name, result))
    print_files(write_tuning(name, result, out))
    return SUCCESS
