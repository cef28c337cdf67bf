"""The commands; nothing is imported before it is needed."""

import argparse
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from geoimp_drake.errors import ConfigurationError, one_line

__all__ = [
    "FAILURE",
    "SUCCESS",
    "UNUSABLE",
    "check",
    "compare",
    "init",
    "list_experiments",
    "named_in",
    "print_files",
    "print_report",
    "reproduce",
    "run",
    "scenario_of",
    "status_of",
    "sweep",
]

SUCCESS, FAILURE, UNUSABLE = 0, 1, 2  # exit status

WORLDS = "worlds"  # the experiment that runs all others


def list_experiments(_: argparse.Namespace) -> int:
    """Names the experiments. Returns the exit status."""
    from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS

    for experiment in EXPERIMENTS.values():
        print(f"{experiment.name:14}{experiment.summary}")
    print(f"{WORLDS:14}every experiment where the plant is not the model: which claims stand")
    return SUCCESS


def run(options: argparse.Namespace) -> int:
    """Runs one experiment. Returns the exit status."""
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment
    from geoimp_drake.simulation.claims import format_claims
    from geoimp_drake.simulation.experiment import run_experiment

    if options.experiment == WORLDS:
        return _run_worlds(options)
    if options.jobs is not None:
        raise ConfigurationError(f"--jobs is for {WORLDS}, which is many runs; leave it out.")
    if options.host is not None and not options.meshcat:
        raise ConfigurationError("--host is where --meshcat listens; give --meshcat as well.")
    experiment = get_experiment(options.experiment or named_in(options.scenario))
    scenario = scenario_of(experiment, options, options.orientation, options.seed)
    name = experiment.name if options.experiment else options.scenario.stem
    result = run_experiment(
        experiment,
        scenario,
        options.out or Path("results") / name,
        figures=not options.no_figures,
        html=options.html,
        live=options.meshcat,
        host=options.host,
    )
    print(format_claims(result.claims))
    print_files(result.files)
    return status_of({experiment.name: result.failure} if result.failure else {})


def _run_worlds(options: argparse.Namespace) -> int:
    """Runs every experiment in other worlds. Returns the exit status."""
    from geoimp_drake.diagrams.experiments.worlds import run_worlds
    from geoimp_drake.simulation.claims import format_claims

    alone = options.scenario, options.html, options.meshcat, options.simulator
    if any(alone) or options.seed is not None:
        raise ConfigurationError(
            "worlds is many runs, each with seeds of its own: leave out --scenario, --html, "
            "--meshcat, --simulator and --seed; --duration and --set are those of every run."
        )
    given = {"duration": options.duration, "impedance.orientation": options.orientation}
    overrides = [f"{path}={value}" for path, value in given.items() if value is not None]
    result = run_worlds(
        options.out or Path("results") / WORLDS,
        jobs=options.jobs or os.cpu_count() or 1,
        overrides=(*overrides, *options.overrides),
    )
    print(format_claims(result.claims))
    print_files(result.files)
    return status_of(result.failures)


def named_in(file: Path | None) -> str:
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


def init(options: argparse.Namespace) -> int:
    """Writes a commented scenario. Returns the exit status."""
    file = options.file
    if options.robot is None:
        if file is None or options.end_effector is not None or options.packages:
            raise ConfigurationError(
                "Name the file to write, or give a robot with --robot; --end-effector and "
                "--package are for one."
            )
        _init_experiment(file, options.base or "plexiglas")
    else:
        if options.base is not None:
            raise ConfigurationError("--robot and --from exclude each other; give one of them.")
        from geoimp_drake.cli.robots import init_robot

        file = file or Path(f"{options.robot.stem}.yaml")
        init_robot(options.robot, options.end_effector, _packages(options), file)
    print(f"written: {file}\nrun it: geoimp run --scenario {file}")
    return SUCCESS


def _packages(options: argparse.Namespace) -> dict[str, Path]:
    """Returns the folders of packages by name."""
    parts = {text: text.partition("=") for text in options.packages}
    for text, (name, _, folder) in parts.items():
        if not (name and folder):
            raise ConfigurationError(f"--package is {text!r}; give NAME=FOLDER.")
    return {name: Path(folder) for name, _, folder in parts.values()}


def _init_experiment(file: Path, name: str) -> None:
    from geoimp_drake.diagrams.experiments.catalogue import OWN, get_experiment
    from geoimp_drake.scenario.template import write_template

    base = get_experiment(name)
    scenario = base.scenario()
    scenario.experiment = OWN[base.setup].name
    write_template(file, scenario, f"Your own experiment, to begin with `geoimp run {name}`.")


def check(options: argparse.Namespace) -> int:
    """Prints what is wrong with a robot or a scenario before it runs. Returns the exit status."""
    from geoimp_drake.cli.robots import check_robot, check_scenario
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment
    from geoimp_drake.scenario.loading import read_layer

    if options.file.suffix.lower() not in (".yaml", ".yml"):
        check_robot(options.file, options.end_effector, _packages(options))
        return SUCCESS
    if options.end_effector is not None or options.packages:
        raise ConfigurationError(
            "--end-effector and --package are for a robot's file; a scenario names its own."
        )
    experiment = get_experiment(named_in(options.file))
    check_scenario(experiment, experiment.scenario((read_layer(options.file),)))
    return SUCCESS


def compare(options: argparse.Namespace) -> int:
    """Runs several orientation families alike. Returns the exit status."""
    from geoimp_drake.campaigns.compare import compare_families
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment
    from geoimp_drake.diagrams.experiments.comparisons import CHAPTER_FAMILIES, COMPARISONS
    from geoimp_drake.simulation.claims import format_claims
    from geoimp_drake.validation import choice

    experiment = get_experiment(options.experiment)
    choice(experiment.name, "experiment to compare families of", COMPARISONS)
    claims, across, files, failures = compare_families(
        experiment,
        COMPARISONS[experiment.name],
        lambda family: scenario_of(experiment, options, family, options.seed),
        options.orientation or CHAPTER_FAMILIES,
        options.out or Path("results") / f"compare-{experiment.name}",
    )
    for family, own in claims.items():
        print(f"{family}\n{format_claims(own)}\n")
    if across:
        print(f"across the families\n{format_claims(across)}")
    print_files(files)
    return status_of(failures)


def sweep(options: argparse.Namespace) -> int:
    """Runs one experiment with parameters drawn at random. Returns the exit status."""
    from geoimp_drake.campaigns.fastest_form import fastest_form
    from geoimp_drake.campaigns.sweep import format_sweep, run_sweep
    from geoimp_drake.campaigns.sweep_plan import SweepPlan
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment

    experiment = get_experiment(options.experiment)
    out = options.out or Path("results") / f"sweep-{experiment.name}"
    result = run_sweep(
        experiment,
        scenario_of(experiment, options, options.orientation, None, fastest_form()),
        SweepPlan.read(options.plan, options.vary, options.samples, options.seed),
        out,
        jobs=(os.cpu_count() or 1) if options.jobs is None else options.jobs,
        scheduler=options.scheduler,
        map_keys=options.map,
    )
    print(format_sweep(experiment.name, result, out))
    print_files(result.files)
    return FAILURE if result.errors == len(result.rows) else SUCCESS


def reproduce(options: argparse.Namespace) -> int:
    """Runs everything that the chapter shows. Returns the exit status."""
    from geoimp_drake.campaigns.reproduce import reproduce as run_all
    from geoimp_drake.diagrams.experiments.reproduction import sections, studies

    out = options.out or Path("results") / "reproduce"
    reproduction = run_all(
        studies(),
        out,
        jobs=(os.cpu_count() or 1) if options.jobs is None else options.jobs,
        duration=options.duration,
        seed=options.seed,
        sections=sections(),
    )
    print_report(reproduction, out)
    return status_of(reproduction.failures())


def scenario_of(
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
        "engine": getattr(options, "simulator", None),
    }
    given = [f"{path}={value}" for path, value in shorthands.items() if value is not None]
    return experiment.scenario(layers, (*given, *options.overrides))


def print_report(reproduction: Any, out: Path) -> None:
    """Prints a summary of a reproduction, and where its page is."""
    from geoimp_drake.campaigns.report import REPORT
    from geoimp_drake.campaigns.reproduction import format_reproduction

    print(format_reproduction(reproduction))
    print(f"\nreport: {out / REPORT}")


def print_files(files: list[Path]) -> None:
    """Prints which files have been written."""
    print("\nwritten:")
    for path in files:
        print(f"  {path}")


def status_of(failures: Mapping[str, Exception | str]) -> int:
    """Prints the failures, by name, and returns the exit status."""
    for name, failure in failures.items():
        print(f"geoimp: the simulation of {name} failed: {one_line(failure)}", file=sys.stderr)
    return FAILURE if failures else SUCCESS
