"""The commands for robots' own interfaces."""

import argparse
import sys
from pathlib import Path

from geoimp_drake.cli.commands import FAILURE, SUCCESS, named_in, print_files, scenario_of
from geoimp_drake.errors import one_line

__all__ = ["drive", "robot_sim", "tare"]


def drive(options: argparse.Namespace) -> int:
    """Drives the robot of a scenario through its own interface. Returns the exit status."""
    from geoimp_drake.cli.driving import drive_robot, look_at_robot
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment

    experiment = get_experiment(named_in(options.scenario))
    scenario = scenario_of(experiment, options, None, None)
    if options.dry_run:
        look_at_robot(scenario)
        return SUCCESS
    out = options.out or Path("results") / options.scenario.stem
    claims, files, failure = drive_robot(
        experiment, scenario, out, figures=not options.no_figures, html=options.html
    )
    print(claims)
    print_files(files)
    if failure is None:
        return SUCCESS
    print(
        f"geoimp: the drive of {options.scenario} ended early: {one_line(failure)}", file=sys.stderr
    )
    return FAILURE


def robot_sim(options: argparse.Namespace) -> int:
    """Simulates the robot of a scenario behind Drake's LCM messages. Returns the exit status."""
    from geoimp_drake.cli.driving import simulate_robot
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment

    experiment = get_experiment(named_in(options.scenario))
    scenario = scenario_of(experiment, options, None, None)
    simulate_robot(scenario, options.lcm, in_step=options.in_step)
    return SUCCESS


def tare(options: argparse.Namespace) -> int:
    """Finds the load on the arm of a scenario. Returns the exit status."""
    from geoimp_drake.cli.taring import tare_robot
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment

    options.duration = None
    experiment = get_experiment(named_in(options.scenario))
    scenario = scenario_of(experiment, options, None, None)
    tare_robot(scenario, options.postures, options.drive, options.log, at_wrist=options.wrist)
    return SUCCESS
