"""One run of an experiment, from scenario to files."""

import json
import logging
import os
import platform
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.errors import ConfigurationError, GeoimpError
from geoimp_drake.scenario.loading import dump_scenario
from geoimp_drake.simulation.claims import Claim
from geoimp_drake.simulation.live import pause_button
from geoimp_drake.simulation.replay import start_meshcat, stop_listening, write_replay
from geoimp_drake.simulation.run import simulate
from geoimp_drake.simulation.style import figure_style
from geoimp_drake.typing import Array

__all__ = ["FileWriter", "RunResult", "run_experiment", "versions"]

_log = logging.getLogger("drake")


@dataclass
class RunResult:
    """What a run left.

    Attributes:
        log: keys of the log contract.
        claims: judged from the log.
        files: that were written.
        failure: what stopped the simulation before its end, if anything did.
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
        scenario: for it; its open fields (start posture, duration) are filled in.
        out: folder to write into; made if need be.
        figures: draw the chapter's figures.
        html: write a replay.
        live: show the run in Meshcat, at real time at most, with sliders and buttons.
        host: address at which it is shown then; by default on this machine alone.

    Raises:
        ConfigurationError: the scenario, the folder or the host cannot be used; nothing has been
            written.
        GeoimpError: the simulation cannot even start; nothing has been written.
    """
    _check_writable(out)
    meshcat = start_meshcat(*experiment.view, host=host) if html or live else None
    if meshcat is not None and not live:
        stop_listening(meshcat)
    setup = experiment.build(scenario, meshcat, live=live)
    if meshcat is not None and html:
        meshcat.StartRecording(frames_per_second=32.0, set_visualizations_while_recording=False)
    wait = None
    if meshcat is not None and live:
        wait = pause_button(meshcat)
        _log.info(f"Meshcat shows the run at {meshcat.web_url()}")
    outcome = simulate(
        setup.diagram,
        scenario.simulator,
        scenario.duration,
        label=scenario.experiment,
        real_time=live,
        events=setup.events,
        wait=wait,
    )
    if outcome.failure is not None and outcome.time == 0.0:
        raise _unusable(outcome.failure)
    log = setup.recorder.collect(outcome.context)
    claims = experiment.claims(log, scenario)
    out.mkdir(parents=True, exist_ok=True)
    writer = FileWriter(out)
    writer.write("log.npz", lambda path: _save_log(log, path))
    writer.write("scenario.yaml", lambda path: path.write_text(dump_scenario(scenario)))
    writer.write(
        "metrics.json",
        lambda path: path.write_text(_metrics(scenario, claims, outcome.failure), "utf-8"),
    )
    if figures:
        for name, figure in experiment.figures(log, scenario).items():
            writer.write_figure(name, figure)
    if meshcat is not None and html:
        meshcat.StopRecording()
        meshcat.PublishRecording()
        writer.write("replay.html", lambda path: write_replay(meshcat, path))
    return RunResult(log, claims, writer.files, outcome.failure)


def _unusable(failure: Exception) -> GeoimpError:
    """Returns the error for a simulation that did not get beyond its start."""
    if isinstance(failure, GeoimpError):
        return failure
    return ConfigurationError(f"The simulation cannot start: {' '.join(str(failure).split())}")


def _check_writable(out: Path) -> None:
    """Raises ConfigurationError if a folder cannot be made or written, before anything is done."""
    existing = next(path for path in (out, *out.absolute().parents) if path.exists())
    if not existing.is_dir():
        raise ConfigurationError(f"The output folder {out} cannot be made: {existing} is a file.")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise ConfigurationError(
            f"The output folder {out} cannot be written: no permission for {existing}. Give "
            f"another with --out."
        )


class FileWriter:
    """Writes each file under another name first: a file that is there is whole."""

    def __init__(self, out: Path):
        self._out = out
        self.files: list[Path] = []

    def write(self, name: str, save: Callable[[Path], Any]) -> None:
        """Writes the file `name` with `save`, which gets a path, and moves it into its place."""
        part = self._out / f".part-{name}"
        save(part)
        part.replace(self._out / name)
        self.files.append(self._out / name)

    def write_figure(self, name: str, figure: Figure) -> None:
        """Writes a figure as NAME.png and, for print, as NAME.pdf; each time the same bytes."""
        # The name of the unfinished file does not tell matplotlib the format.
        with figure_style():
            self.write(f"{name}.png", lambda path: figure.savefig(path, format="png"))
            undated = {"CreationDate": None}
            self.write(
                f"{name}.pdf", lambda path: figure.savefig(path, format="pdf", metadata=undated)
            )


def _save_log(log: dict[str, Array], path: Path) -> None:
    with path.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **log)


def _metrics(scenario: Any, claims: list[Claim], failure: Exception | None) -> str:
    metrics = {
        "experiment": scenario.experiment,
        "seed": scenario.seed,
        "duration": scenario.duration,
        "failure": None if failure is None else str(failure),
        "claims": [claim.as_dict() for claim in claims],
        "versions": versions(),
    }
    return json.dumps(metrics, indent=2, ensure_ascii=False, default=float) + "\n"


def versions() -> dict[str, str]:
    """Returns the versions of what a run's numbers depend on."""
    return {
        "geoimp_drake": version("geoimp-drake"),
        "drake": version("drake"),
        "numpy": np.__version__,
        "python": platform.python_version(),
    }
