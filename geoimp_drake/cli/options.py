"""Options that several commands have."""

import argparse
from pathlib import Path

__all__ = [
    "add_duration",
    "add_experiment",
    "add_overrides",
    "add_scenario_options",
    "add_scheduler",
]


def add_overrides(parser: argparse.ArgumentParser) -> None:
    """Adds `--set`."""
    parser.add_argument(
        "--set",
        dest="overrides",
        action="append",
        default=[],
        metavar="KEY.PATH=VALUE",
        help="set a field of the scenario; may be repeated",
    )


def add_scenario_options(parser: argparse.ArgumentParser) -> None:
    """Adds the options that lay a scenario over the experiment's own, and the output folder."""
    add_overrides(parser)
    parser.add_argument(
        "--scenario", type=Path, metavar="FILE", help="YAML file laid over the experiment's own"
    )
    parser.add_argument("--duration", type=float, metavar="S", help="simulated time [s]")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder to write (below results/)")
    parser.add_argument(
        "--seed", type=int, metavar="N", help="of the sensor's noise; of a sweep's draws"
    )


def add_scheduler(parser: argparse.ArgumentParser) -> None:
    """Adds the scheduler of many runs."""
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="of a Dask scheduler whose workers are used; start them with --nthreads 1, and with "
        "TLS: whoever reaches them can run code there",
    )


def add_experiment(parser: argparse.ArgumentParser) -> None:
    """Adds the experiment, which a scenario file may name instead."""
    parser.add_argument(
        "experiment",
        metavar="EXPERIMENT",
        nargs="?",
        help="a name that `geoimp list` shows; by default the one that the scenario file names",
    )


def add_duration(parser: argparse.ArgumentParser) -> None:
    """Adds the duration."""
    parser.add_argument("--duration", type=float, metavar="S", help="of the motion [s]")
