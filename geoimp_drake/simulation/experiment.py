"""One run of an experiment, from scenario to files."""

import io
import json
import logging
import platform
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat

from geoimp_drake.errors import ConfigurationError, GeoimpError, one_line
from geoimp_drake.output_folder import check_folder, write_files
from geoimp_drake.scenario.loading import dump_scenario
from geoimp_drake.simulation.claims import Claim
from geoimp_drake.simulation.energy_audit import AUDIT, audit_figure, audited
from geoimp_drake.simulation.live import pause_button
from geoimp_drake.simulation.replay import start_meshcat, start_recording, stop_listening
from geoimp_drake.simulation.run import simulate
from geoimp_drake.simulation.style import figure_contents, figure_files
from geoimp_drake.typing import Array

__all__ = [
    "RUN_FILES",
    "RunResult",
    "as_npz",
    "cannot_start",
    "run_experiment",
    "simulated",
    "versions",
    "write_run",
]

# The files of a run, besides the experiment's own figures.
RUN_FILES = ("log.npz", "scenario.yaml", "metrics.json", "replay.html", *figure_files(AUDIT))

_log = logging.getLogger("drake")


@dataclass
class RunResult:
    """The results of a run.

    Attributes:
        log: arrays, by the keys of the log contract.
        claims: judged from the log.
        files: those that were written.
        failure: the error that stopped the simulation before its end, if any.
    """

    log: dict[str, Array]
    claims: list[Claim]
    files: list[Path]
    failure: Exception | None


def run_experiment(
    experiment: Any,
    scenario: Any,
    out: Path,
    *,
    figures: bool = True,
    html: bool = False,
    live: bool = False,
    host: str | None = None,
) -> RunResult:
    """Builds, simulates and writes one experiment.

    Args:
        experiment: from the catalogue.
        scenario: the experiment's; open fields (start posture, duration) are filled in.
        out: folder to write into; made if need be.
        figures: draw the chapter's figures.
        html: write a replay.
        live: show the run in Meshcat, at most in real time, with sliders and buttons.
        host: address at which Meshcat shows it; by default for this machine alone.

    Raises:
        ConfigurationError: the scenario, the folder or the host cannot be used; nothing has been
            written.
        GeoimpError: the simulation cannot even start; nothing has been written.
        OutputError: some files could not be written; the message names them, the others exist.
    """
    check_folder(out, RUN_FILES)
    if scenario.engine != "drake":
        return _run_elsewhere(experiment, scenario, out, figures, html, live)
    meshcat = start_meshcat(*experiment.view, host=host) if html or live else None
    if meshcat is not None and not live:
        stop_listening(meshcat)
    setup = experiment.build(scenario, meshcat, live=live)
    if meshcat is not None and html:
        start_recording(meshcat)
    wait = None
    if meshcat is not None and live:
        wait = pause_button(meshcat)
        _log.info(f"Meshcat shows the run at {meshcat.web_url()}")
    log, failure = simulated(setup, scenario, scenario.experiment, real_time=live, wait=wait)
    replay = meshcat if html else None
    return write_run(experiment, scenario, log, failure, out, figures, replay)


def simulated(
    setup: Any,
    scenario: Any,
    label: str = "",
    *,
    real_time: bool = False,
    wait: Callable[[], bool] | None = None,
) -> tuple[dict[str, Array], Exception | None]:
    """Returns the log of a scenario's run, and the error that stopped it early.

    Args:
        setup: built from the scenario.
        scenario: its open fields are filled in.
        label: see `simulate`, as the following.
        real_time: see there.
        wait: see there.

    Raises:
        GeoimpError: the simulation cannot even start.
    """
    outcome = simulate(
        setup.diagram,
        scenario.simulator,
        scenario.duration,
        label=label,
        real_time=real_time,
        events=setup.events,
        wait=wait,
    )
    if outcome.failure is not None and outcome.time == 0.0:
        raise cannot_start(outcome.failure)
    return setup.recorder.collect(outcome.context), outcome.failure


def _run_elsewhere(
    experiment: Any, scenario: Any, out: Path, figures: bool, html: bool, live: bool
) -> RunResult:
    """Does the same in the scenario's own simulator; it draws the replay from the log."""
    if live:
        raise ConfigurationError(
            f"Only Drake's simulation can be watched as it runs, and engine is "
            f"'{scenario.engine}': give --html instead of --meshcat."
        )
    log, failure = experiment.run_elsewhere(scenario)
    replay = experiment.replay(scenario, log) if html else None
    return write_run(experiment, scenario, log, failure, out, figures, replay)


def write_run(
    experiment: Any,
    scenario: Any,
    log: dict[str, Array],
    failure: Exception | None,
    out: Path,
    figures: bool = True,
    replay: Meshcat | None = None,
) -> RunResult:
    """Judges a run and writes its results.

    Args:
        experiment: from the catalogue.
        scenario: the one that was run.
        log: of the run.
        failure: the error that stopped it before its end, if any.
        out: folder to write into; made if need be.
        figures: draw the chapter's figures.
        replay: the one that recorded the run, if any.

    Raises:
        OutputError: some files could not be written; the message names them, the others exist.
    """
    result = RunResult(log, experiment.claims(log, scenario), [], failure)
    result.files = write_files(out, _contents(experiment, scenario, result, figures, replay))
    return result


def _contents(
    experiment: Any, scenario: Any, result: RunResult, figures: bool, replay: Meshcat | None
) -> Iterator[tuple[str, bytes | str]]:
    """Yields the name and the content of each file of a run."""
    yield "log.npz", as_npz(result.log)
    yield "scenario.yaml", dump_scenario(scenario)
    yield "metrics.json", _metrics(scenario, result.claims, result.failure)
    if figures:
        for name, figure in experiment.figures(result.log, scenario).items():
            yield from figure_contents(name, figure)
        if audited(result.log):
            yield from figure_contents(AUDIT, audit_figure(result.log))
    if replay is not None:
        replay.StopRecording()
        replay.PublishRecording()
        yield "replay.html", replay.StaticHtml()


def cannot_start(failure: Exception) -> GeoimpError:
    """Returns the error for a simulation that did not get beyond its start."""
    if isinstance(failure, GeoimpError):
        return failure
    return ConfigurationError(f"The simulation cannot start: {one_line(failure)}")


def as_npz(log: dict[str, Array]) -> bytes:
    """Returns the contents of a log's file."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **log)
    return buffer.getvalue()


def _metrics(scenario: Any, claims: list[Claim], failure: Exception | None) -> str:
    metrics = {
        "experiment": scenario.experiment,
        "seed": scenario.seed,
        "duration": scenario.duration,
        "failure": None if failure is None else str(failure),
        "claims": [claim.as_dict() for claim in claims],
        "versions": versions(scenario.engine),
    }
    return json.dumps(metrics, indent=2, ensure_ascii=False, default=float) + "\n"


def versions(engine: str = "drake") -> dict[str, str]:
    """Returns the versions of all packages on which a run's numbers in a simulator depend."""
    other = {} if engine == "drake" else {engine: version(engine)}
    return other | {
        "geoimp_drake": version("geoimp-drake"),
        "drake": version("drake"),
        "numpy": np.__version__,
        "python": platform.python_version(),
    }
