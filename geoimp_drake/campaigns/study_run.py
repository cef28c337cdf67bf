"""One run of a study in a process of its own, and whether its files are up to date."""

import hashlib
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from geoimp_drake.campaigns.journal import Finished
from geoimp_drake.errors import one_line
from geoimp_drake.simulation.experiment import RUN_FILES, run_experiment, versions

__all__ = ["RUN_FIELDS", "StudyRun", "identity_of", "is_current", "run_study_run"]

# Types of the results of `run_study_run`.
RUN_FIELDS = {"identity": str, "files": dict, "failure": str | None}

_PACKAGE = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class StudyRun:
    """All that a process needs to run one variant of an experiment.

    Attributes:
        experiment: from the catalogue.
        scenario: data of the variant's scenario.
        folder: to write into.
        html: write a replay.
        identity: of its results, see `identity_of`.
    """

    experiment: Any
    scenario: dict[str, Any]
    folder: Path
    html: bool
    identity: str


def identity_of(scenario: dict[str, Any], *, html: bool) -> str:
    """Returns a hash of all on which a run's files depend: scenario, versions, and this library."""
    depends = [scenario, html, versions(scenario["engine"]), _sources()]
    return hashlib.sha256(json.dumps(depends, sort_keys=True).encode()).hexdigest()


def run_study_run(run: StudyRun) -> dict[str, Any]:
    """Returns the run's `identity`, its `files` by name with their hashes, and its `failure`.

    Raises:
        GeoimpError: the scenario cannot be used; nothing has been written.
    """
    scenario = run.experiment.scenario((run.scenario,))
    result = run_experiment(run.experiment, scenario, run.folder, html=run.html)
    failure = None if result.failure is None else one_line(result.failure)
    files = {path.name: _hash(path) for path in result.files}
    return {"identity": run.identity, "files": files, "failure": failure}


def is_current(run: StudyRun, finished: Finished) -> bool:
    """Returns whether a run has ended, would be the same now, and its files are unchanged.

    A run that ended with an error has no files; it is to be tried again.
    """
    if not finished.result or finished.result["identity"] != run.identity:
        return False
    files = finished.result["files"]
    expected = {name for name in RUN_FILES if run.html or name != "replay.html"}
    return expected <= files.keys() and all(
        _is_unchanged(run.folder / name, digest) for name, digest in files.items()
    )


def _is_unchanged(path: Path, digest: str) -> bool:
    return path.is_file() and _hash(path) == digest


def _hash(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@cache
def _sources() -> str:
    """Returns a hash of the package: its modules, models and scenarios."""
    return hashlib.sha256(
        b"".join(str(path.relative_to(_PACKAGE)).encode() + path.read_bytes() for path in _files())
    ).hexdigest()


def _files() -> Iterator[Path]:
    """Yields the package's own files in a fixed order, without the caches of Python and numba."""
    for folder, inner, names in os.walk(_PACKAGE, followlinks=True):
        inner[:] = sorted(name for name in inner if name != "__pycache__")
        yield from (Path(folder, name) for name in sorted(names))
