"""The command line `geoimp`: list, init, run, compare, sweep, reproduce and time experiments.

Exit status: 0 on success, 2 on unusable input (one line says what), 1 if a simulation failed.
"""

import argparse
import contextlib
import logging
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

from geoimp_drake import __version__
from geoimp_drake.errors import ConfigurationError, GeoimpError

__all__ = ["main"]

SUCCESS, FAILURE, UNUSABLE = 0, 1, 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit status."""
    options = _parser().parse_args(arguments)
    try:
        with _log_on_terminal():
            return int(options.command(options))
    except GeoimpError as error:
        print(f"geoimp: {error}", file=sys.stderr)
        return UNUSABLE
    except KeyboardInterrupt:
        print("geoimp: interrupted", file=sys.stderr)
        return FAILURE


@contextlib.contextmanager
def _log_on_terminal() -> Iterator[None]:
    """Shows what Drake and this library report; Python by itself shows warnings only."""
    handler, log = logging.StreamHandler(), logging.getLogger("drake")
    log.addHandler(handler)
    try:
        yield
    finally:
        log.removeHandler(handler)


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
    init = commands.add_parser("init", help="write a commented scenario of your own, to be edited")
    init.add_argument("file", type=Path, metavar="FILE", help="YAML file to write")
    init.add_argument(
        "--from", dest="base", default="plexiglas", metavar="EXPERIMENT", help="to start from"
    )
    init.set_defaults(command=_init)
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
    sweep = commands.add_parser("sweep", help="run one experiment with parameters drawn at random")
    _add_sweep_options(sweep)
    sweep.set_defaults(command=_sweep)
    reproduce = commands.add_parser(
        "reproduce",
        help="run everything that the chapter shows and write one report",
        description="Runs every experiment with every variant that its figures need, and writes "
        "report.html. Started again with the same folder it does only what is missing or would "
        "come out differently.",
        epilog="Exit status: 0, also if claims fail, which the summary lists; 1 if a simulation "
        "failed; 2 if the input is unusable.",
    )
    _add_reproduce_options(reproduce)
    reproduce.set_defaults(command=_reproduce)
    bench = commands.add_parser("bench", help="time the closed loop against the bare plant")
    bench.add_argument("--json", type=Path, metavar="FILE", help="write the figures to FILE")
    bench.add_argument(
        "--only", nargs="+", metavar="CASE", help=f"of {', '.join(_BENCH_CASES)} (all)"
    )
    bench.add_argument(
        "--compare", type=Path, metavar="FILE", help="show what got slower since FILE was written"
    )
    bench.set_defaults(command=_bench)
    return parser


def _add_run_options(run: argparse.ArgumentParser) -> None:
    run.add_argument(
        "experiment",
        metavar="EXPERIMENT",
        nargs="?",
        help="a name that `geoimp list` shows; by default the one that the scenario file names",
    )
    run.add_argument("--orientation", metavar="FAMILY", help="orientation family of the impedance")
    _add_scenario_options(run)
    run.add_argument("--no-figures", action="store_true", help="write no figures")
    view = run.add_mutually_exclusive_group()
    view.add_argument("--html", action="store_true", help="write replay.html")
    view.add_argument(
        "--meshcat", action="store_true", help="show the run in a browser, at real time at most"
    )


def _add_sweep_options(sweep: argparse.ArgumentParser) -> None:
    sweep.add_argument("experiment", metavar="EXPERIMENT", help="a name that `geoimp list` shows")
    sweep.add_argument(
        "--orientation", metavar="FAMILY", help="orientation family of the impedance"
    )
    sweep.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="KEY.PATH=LOW:HIGH",
        help="draw a number of the scenario uniformly; may be repeated",
    )
    sweep.add_argument(
        "--plan", type=Path, metavar="FILE", help="YAML file with vary, samples and seed"
    )
    sweep.add_argument("--samples", type=int, metavar="N", help="how many (64)")
    sweep.add_argument("--jobs", type=int, metavar="J", help="processes (one a core)")
    sweep.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="of a Dask scheduler whose workers are used; start them with --nthreads 1, and with "
        "TLS: whoever reaches them can run code there",
    )
    sweep.add_argument(
        "--map", nargs=2, default=(), metavar=("X", "Y"), help="varied keys of the map (first two)"
    )
    _add_scenario_options(sweep)


def _add_reproduce_options(reproduce: argparse.ArgumentParser) -> None:
    reproduce.add_argument(
        "--out", type=Path, metavar="DIR", help="folder to write (results/reproduce)"
    )
    reproduce.add_argument("--jobs", type=int, metavar="N", help="processes (one a core)")
    reproduce.add_argument(
        "--duration", type=float, metavar="S", help="cut every run off after this time [s]"
    )
    reproduce.add_argument("--seed", type=int, metavar="N", help="of the sensors' noise")


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
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder to write (below results/)")
    parser.add_argument(
        "--seed", type=int, metavar="N", help="of the sensor's noise; of a sweep's draws"
    )


def _list(_: argparse.Namespace) -> int:
    from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS

    for experiment in EXPERIMENTS.values():
        print(f"{experiment.name:14}{experiment.summary}")
    return SUCCESS


def _run(options: argparse.Namespace) -> int:
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment
    from geoimp_drake.simulation.claims import format_claims
    from geoimp_drake.simulation.experiment import run_experiment

    experiment = get_experiment(options.experiment or _named_in(options.scenario))
    scenario = _scenario(experiment, options, options.orientation, options.seed)
    name = experiment.name if options.experiment else options.scenario.stem
    result = run_experiment(
        experiment,
        scenario,
        options.out or Path("results") / name,
        figures=not options.no_figures,
        html=options.html,
        live=options.meshcat,
    )
    print(format_claims(result.claims))
    _print_files(result.files)
    return _status({experiment.name: result.failure} if result.failure else {})


def _named_in(file: Path | None) -> str:
    """Returns the experiment that a scenario file names."""
    from geoimp_drake.scenario.loading import read_yaml

    if file is None:
        raise ConfigurationError(
            "Name an experiment that `geoimp list` shows, or give a scenario file with --scenario."
        )
    name = read_yaml(file).get("experiment")
    if not isinstance(name, str):
        raise ConfigurationError(
            f"{file} does not name its experiment: give one on the command line, or the key "
            f"'experiment' ('custom' for one of your own; `geoimp init` writes such a file)."
        )
    return name


def _init(options: argparse.Namespace) -> int:
    from geoimp_drake.diagrams.experiments.catalogue import OWN, get_experiment
    from geoimp_drake.scenario.template import write_template

    base = get_experiment(options.base)
    write_template(options.file, base, OWN[base.setup].name)
    print(f"written: {options.file}\nrun it: geoimp run --scenario {options.file}")
    return SUCCESS


def _compare(options: argparse.Namespace) -> int:
    from geoimp_drake.campaigns.compare import compare_families
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment
    from geoimp_drake.diagrams.experiments.comparisons import CHAPTER_FAMILIES, COMPARISONS
    from geoimp_drake.simulation.claims import format_claims

    experiment = get_experiment(options.experiment)
    claims, across, files, failures = compare_families(
        experiment,
        COMPARISONS[experiment.name],
        lambda family: _scenario(experiment, options, family, options.seed),
        options.orientation or CHAPTER_FAMILIES,
        options.out or Path("results") / f"compare-{experiment.name}",
    )
    for family, own in claims.items():
        print(f"{family}\n{format_claims(own)}\n")
    if across:
        print(f"across the families\n{format_claims(across)}")
    _print_files(files)
    return _status(failures)


def _sweep(options: argparse.Namespace) -> int:
    from geoimp_drake.campaigns.fastest_form import fastest_form
    from geoimp_drake.campaigns.sweep import format_sweep, run_sweep
    from geoimp_drake.campaigns.sweep_plan import SweepPlan
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment

    experiment = get_experiment(options.experiment)
    out = options.out or Path("results") / f"sweep-{experiment.name}"
    result = run_sweep(
        experiment,
        _scenario(experiment, options, options.orientation, None, fastest_form()),
        SweepPlan.read(options.plan, options.vary, options.samples, options.seed),
        out,
        jobs=(os.cpu_count() or 1) if options.jobs is None else options.jobs,
        scheduler=options.scheduler,
        map_keys=options.map,
    )
    print(format_sweep(experiment.name, result, out))
    _print_files(result.files)
    return FAILURE if result.errors == len(result.rows) else SUCCESS


def _reproduce(options: argparse.Namespace) -> int:
    from geoimp_drake.campaigns.report import REPORT
    from geoimp_drake.campaigns.reproduce import reproduce
    from geoimp_drake.campaigns.reproduction import format_reproduction
    from geoimp_drake.diagrams.experiments.reproduction import studies

    out = options.out or Path("results") / "reproduce"
    reproduction = reproduce(
        studies(),
        out,
        jobs=(os.cpu_count() or 1) if options.jobs is None else options.jobs,
        duration=options.duration,
        seed=options.seed,
    )
    print(format_reproduction(reproduction))
    print(f"\nreport: {out / REPORT}")
    return _status(reproduction.failures())


def _scenario(
    experiment: Any,
    options: argparse.Namespace,
    orientation: str | None,
    seed: int | None,
    *layers: dict[str, Any],
) -> Any:
    """Returns the experiment's scenario with layers, the file and the options laid over it."""
    from geoimp_drake.scenario.loading import read_layer

    if options.scenario:
        layers = (*layers, read_layer(options.scenario))
    shorthands = {
        "impedance.orientation": orientation,
        "duration": options.duration,
        "seed": seed,
    }
    given = [f"{path}={value}" for path, value in shorthands.items() if value is not None]
    return experiment.scenario(layers, (*given, *options.overrides))


def _print_files(files: list[Path]) -> None:
    print("\nwritten:")
    for path in files:
        print(f"  {path}")


def _status(failures: Mapping[str, Exception | str]) -> int:
    for name, failure in failures.items():
        print(f"geoimp: the simulation of {name} failed: {failure}", file=sys.stderr)
    return FAILURE if failures else SUCCESS


# What is timed: experiment, when, and whether its real-time factor counts as the experiment's.
_BENCH_CASES = {
    "single_free": ("plexiglas", 1.0, False),
    "plexiglas": ("plexiglas", 6.0, True),
    "redundant_free": ("redundancy", 1.0, False),
    "redundancy": ("redundancy", 11.0, True),
    "bar_free": ("bar", 1.0, False),
    "bar": ("bar", 6.0, True),
    "peg_in_hole": ("peg_in_hole", 8.0, True),
}


def _bench(options: argparse.Namespace) -> int:
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment
    from geoimp_drake.simulation.bench import BenchCase, run_bench
    from geoimp_drake.validation import choice

    for name in options.only or ():
        choice(name, "case", _BENCH_CASES)
    cases = [
        BenchCase(name, get_experiment(experiment), start, real_time)
        for name, (experiment, start, real_time) in _BENCH_CASES.items()
        if name in (options.only or _BENCH_CASES)
    ]
    print(run_bench(cases, options.json, options.compare))
    return SUCCESS


if __name__ == "__main__":
    sys.exit(main())
