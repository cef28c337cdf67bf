"""The command line `geoimp`: list, run and time the experiments.

Exit status: 0 on success, 2 on unusable input (one line says what), 1 if a simulation failed.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from geoimp_drake import __version__
from geoimp_drake.errors import GeoimpError

__all__ = ["main"]

SUCCESS, FAILURE, UNUSABLE = 0, 1, 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit status."""
    options = _parser().parse_args(arguments)
    try:
        return int(options.command(options))
    except GeoimpError as error:
        print(f"geoimp: {error}", file=sys.stderr)
        return UNUSABLE
    except KeyboardInterrupt:
        print("geoimp: interrupted", file=sys.stderr)
        return FAILURE


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, as every other error here."""

    def error(self, message: str) -> NoReturn:
        self.exit(UNUSABLE, f"geoimp: {message} (see {self.prog} --help)\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="geoimp",
        description="Six-DOF impedance control in Drake: the chapter's experiments.",
    )
    parser.add_argument("--version", action="version", version=f"geoimp {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND", parser_class=_Parser)
    listing = commands.add_parser("list", help="name the experiments")
    listing.set_defaults(command=_list)
    run = commands.add_parser("run", help="run one experiment and write log, claims and figures")
    _add_run_options(run)
    run.set_defaults(command=_run)
    compare = commands.add_parser("compare", help="run several orientation families alike")
    compare.add_argument("experiment", metavar="EXPERIMENT")
    compare.add_argument(
        "--orientation", nargs="+", metavar="FAMILY", help="families (the chapter's three)"
    )
    _add_scenario_options(compare)
    compare.set_defaults(command=_compare)
    bench = commands.add_parser("bench", help="time the closed loop against the bare plant")
    bench.add_argument("--json", type=Path, metavar="FILE", help="write the figures to FILE")
    bench.set_defaults(command=_bench)
    return parser


def _add_run_options(run: argparse.ArgumentParser) -> None:
    run.add_argument("experiment", metavar="EXPERIMENT", help="a name that `geoimp list` shows")
    run.add_argument("--orientation", metavar="FAMILY", help="orientation family of the impedance")
    _add_scenario_options(run)
    run.add_argument("--no-figures", action="store_true", help="write no figures")
    view = run.add_mutually_exclusive_group()
    view.add_argument("--html", action="store_true", help="write replay.html")
    view.add_argument(
        "--meshcat", action="store_true", help="show the run in a browser, at real time at most"
    )


def _add_scenario_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--set",
        dest="overrides",
        action="append",
        default=[],
        metavar="KEY.PATH=VALUE",
        help="set a field of the scenario; may be repeated",
    )
    parser.add_argument(
        "--scenario", type=Path, metavar="FILE", help="YAML file laid over the experiment's own"
    )
    parser.add_argument("--duration", type=float, metavar="S", help="simulated time [s]")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder to write (results/EXPERIMENT)"
    )
    parser.add_argument("--seed", type=int, metavar="N", help="of the sensor's noise")


def _list(_: argparse.Namespace) -> int:
    from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS

    for experiment in EXPERIMENTS.values():
        print(f"{experiment.name:14}{experiment.summary}")
    return SUCCESS


def _run(options: argparse.Namespace) -> int:
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment
    from geoimp_drake.simulation.claims import format_claims
    from geoimp_drake.simulation.experiment import run_experiment

    experiment = get_experiment(options.experiment)
    scenario = _scenario(experiment, options, options.orientation)
    result = run_experiment(
        experiment,
        scenario,
        options.out or Path("results") / experiment.name,
        figures=not options.no_figures,
        html=options.html,
        live=options.meshcat,
    )
    print(format_claims(result.claims))
    _print_files(result.files)
    return _status({experiment.name: result.failure} if result.failure else {})


def _compare(options: argparse.Namespace) -> int:
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment
    from geoimp_drake.diagrams.experiments.comparisons import CHAPTER_FAMILIES, COMPARISONS
    from geoimp_drake.simulation.claims import format_claims
    from geoimp_drake.simulation.compare import compare_families

    experiment = get_experiment(options.experiment)
    claims, across, files, failures = compare_families(
        experiment,
        COMPARISONS[experiment.name],
        lambda family: _scenario(experiment, options, family),
        options.orientation or CHAPTER_FAMILIES,
        options.out or Path("results") / f"compare-{experiment.name}",
    )
    for family, own in claims.items():
        print(f"{family}\n{format_claims(own)}\n")
    if across:
        print(f"across the families\n{format_claims(across)}")
    _print_files(files)
    return _status(failures)


def _scenario(experiment: Any, options: argparse.Namespace, orientation: str | None) -> Any:
    """Returns the experiment's scenario with the file and the options laid over it."""
    from geoimp_drake.scenario import read_yaml

    layers = (read_yaml(options.scenario),) if options.scenario else ()
    shorthands = {
        "impedance.orientation": orientation,
        "duration": options.duration,
        "seed": options.seed,
    }
    given = [f"{path}={value}" for path, value in shorthands.items() if value is not None]
    return experiment.scenario(layers, (*given, *options.overrides))


def _print_files(files: list[Path]) -> None:
    print("\nwritten:")
    for path in files:
        print(f"  {path}")


def _status(failures: dict[str, Exception]) -> int:
    for name, failure in failures.items():
        print(f"geoimp: the simulation of {name} failed: {failure}", file=sys.stderr)
    return FAILURE if failures else SUCCESS


def _bench(options: argparse.Namespace) -> int:
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment
    from geoimp_drake.simulation.bench import run_bench

    print(run_bench(options.json, get_experiment("plexiglas")))
    return SUCCESS


if __name__ == "__main__":
    sys.exit(main())
