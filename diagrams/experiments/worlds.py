"""Every experiment in worlds that are not its controller's model: which claims stand, and how far.

```
 OUT/worlds.csv           claim × error: holds, to what size, or fails; of a mix, of how many seeds
 OUT/worlds.png, .pdf     the same as a heat map
 OUT/worlds.json          what is claimed of the deviations, with values and bounds
 OUT/journal.jsonl        what has finished
```
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from geoimp_drake.campaigns.fastest_form import fastest_form
from geoimp_drake.campaigns.journal import Finished
from geoimp_drake.campaigns.many_runs import run_many
from geoimp_drake.campaigns.reproduction import SectionResult
from geoimp_drake.campaigns.study_run import identity_of
from geoimp_drake.diagrams.experiments.catalogue import Experiment, get_experiment
from geoimp_drake.diagrams.experiments.measures import Log, true_motion
from geoimp_drake.diagrams.experiments.worlds_matrix import (
    Matrix,
    World,
    heat_map,
    matrix_of,
    table,
)
from geoimp_drake.errors import one_line
from geoimp_drake.output_folder import check_folder, write_files
from geoimp_drake.scenario.loading import plain_data, read_yaml
from geoimp_drake.simulation.claims import Claim, at_most, last_second
from geoimp_drake.simulation.experiment import simulated
from geoimp_drake.simulation.style import figure_contents, figure_files
from geoimp_drake.systems.frame_motion import POSITION

__all__ = ["WorldsResult", "WorldsSection", "run_world", "run_worlds", "worlds"]

_JOURNAL = "journal.jsonl"
_FILES = (_JOURNAL, "worlds.csv", "worlds.json", *figure_files("worlds"))
_FIELDS = {"identity": str, "claims": list, "deviation": list, "failure": str | None}
_FORCE, _STIFFNESS = (
    "at rest f = K_p Δp_de, true f and E, relative error",
    "normal force over depth",
)

# Bounds for plexiglas, by error and size. They hold for E's distance from C at rest and ever [mm],
# and for the relative errors of force and stiffness.
_BOUNDS = {
    ("masses", "+10 %"): (0.6, 0.6, 0.01, 0.03),
    ("Coulomb friction", "2 %"): (4.0, 4.0, 0.05, 0.03),
    ("mild", ""): (1.5, 3.0, 0.04, 0.03),
    ("rough", ""): (6.0, 10.0, 0.12, 0.1),
}


@dataclass(frozen=True)
class WorldsResult:
    """The results of the experiment.

    Attributes:
        matrix: by experiment and claim, then by error.
        claims: on the deviations.
        failures: the errors that stopped runs, by key.
        files: those that were written.
    """

    matrix: Matrix
    claims: list[Claim]
    failures: dict[str, str]
    files: list[Path]


def worlds(plan: Mapping[str, Any], overrides: Sequence[str] = ()) -> Iterator[World]:
    """Yields every run of a plan, `worlds.yaml` as data, or those whose keys fit its `only`.

    The overrides apply to all runs.
    """
    for world in _all_worlds(plan, overrides):
        if any(fnmatchcase(world.key, pattern) for pattern in plan.get("only", "*")):
            yield world


def _all_worlds(plan: Mapping[str, Any], overrides: Sequence[str]) -> Iterator[World]:
    for name in plan["experiments"]:
        experiment = get_experiment(name)
        for error, sizes in {"none": {"": []}, **plan["errors"]}.items():
            for size, settings in sizes.items():
                yield _world(experiment, error, size, 0, settings, overrides)
        for mix, settings in plan["mixes"].items():
            for seed in range(plan["seeds"]):
                yield _world(experiment, mix, "", seed, settings, overrides)


def _world(
    experiment: Experiment,
    error: str,
    size: str,
    seed: int,
    settings: Sequence[str],
    overrides: Sequence[str],
) -> World:
    own = (*settings, f"seed={seed}", *overrides)
    data = plain_data(experiment.scenario((fastest_form(),), own))
    return World(experiment.name, error, size, seed, data)


def run_world(world: World) -> dict[str, Any]:
    """Returns the run's `claims`, the `deviation` of E from C at rest and ever [mm], and `failure`.

    The result's `identity` is that of scenario and library.
    """
    experiment = get_experiment(world.experiment)
    scenario = experiment.scenario((world.scenario,))
    log, failure = simulated(experiment.build(scenario), scenario)
    claims = [claim.as_dict() for claim in experiment.claims(log, scenario)]
    return {
        "identity": _identity(world),
        "claims": claims,
        "deviation": _deviation(log, scenario.compliant),
        "failure": None if failure is None else one_line(failure),
    }


def _identity(world: World) -> str:
    return identity_of(world.scenario, html=False)


def _deviation(log: Log, arm: str) -> list[float]:
    offset = true_motion(log, arm)[:, POSITION] - log[f"{arm}/motion_C"][:, POSITION]
    distance = 1e3 * np.linalg.norm(offset, axis=1)
    return [float(distance[last_second(log)].mean()), float(distance.max())]


def run_worlds(
    out: Path,
    *,
    jobs: int = 1,
    overrides: Sequence[str] = (),
    plan: Mapping[str, Any] | None = None,
) -> WorldsResult:
    """Runs the worlds that `out` does not have yet, and writes table, heat map and claims.

    Args:
        out: folder to write into; made if need be.
        jobs: processes on this machine.
        overrides: settings of every run.
        plan: the worlds; `worlds.yaml` beside this file by default.

    Raises:
        ConfigurationError: an override or the folder cannot be used; nothing has been written.
        OutputError: the disk is full.
    """
    check_folder(out, _FILES)
    plan = plan or read_yaml(Path(__file__).with_suffix(".yaml"))
    runs = {world.key: world for world in worlds(plan, overrides)}

    def is_current(key: str, ended: Finished) -> bool:
        result = ended.result
        return key in runs and bool(result) and result["identity"] == _identity(runs[key])

    finished = run_many(
        runs,
        run_world,
        jobs=jobs,
        journal=out / _JOURNAL,
        # With other seeds or fewer experiments, finished runs stay.
        plan={"errors": plan["errors"], "mixes": plan["mixes"], "overrides": list(overrides)},
        label="geoimp run worlds",
        fields=_FIELDS,
        is_current=is_current,
    )
    matrix = matrix_of(runs, {key: ended.result for key, ended in finished.items()})
    claims = _claims(runs, finished)
    contents: list[tuple[str, bytes | str]] = [
        ("worlds.csv", table(matrix)),
        (
            "worlds.json",
            json.dumps([one.as_dict() for one in claims], indent=2, ensure_ascii=False),
        ),
        *figure_contents("worlds", heat_map(matrix)),
    ]
    failures = {
        key: ended.error or ended.result["failure"]
        for key, ended in finished.items()
        if ended.error or ended.result["failure"]
    }
    return WorldsResult(matrix, claims, failures, write_files(out, contents))


def _claims(runs: Mapping[str, World], finished: Mapping[str, Finished]) -> list[Claim]:
    """Returns the bounds on the worst run of plexiglas, by error."""
    claims = []
    for (error, size), bounds in _BOUNDS.items():
        results = [
            finished[key].result
            for key, world in runs.items()
            if (world.experiment, world.error, world.size) == ("plexiglas", error, size)
        ]
        if not results:
            continue
        worst = _worst([result for result in results if result])
        words = f"{error} {size}".strip()
        names = ("E off C at rest", "E off C at most", "f off K_p Δp_de", "stiffness off its value")
        units = ("mm", "mm", "", "")
        claims += [
            at_most(f"plexiglas, {words}: {name}", value, bound, unit)
            for name, value, bound, unit in zip(names, worst, bounds, units, strict=True)
        ]
    return claims


def _worst(results: Sequence[Mapping[str, Any]]) -> list[float | None]:
    rows = []
    for result in results:
        values = {claim["claim"]: claim["value"] for claim in result["claims"]}
        nominal = 700.0 * 1e4 / (700.0 + 1e4)
        force, stiffness = values.get(_FORCE), values.get(_STIFFNESS)
        off = None if stiffness is None else abs(stiffness / nominal - 1.0)
        rows.append([*result["deviation"], force, off])
    if not rows or any(value is None for row in rows for value in row):
        return [None] * 4
    return [float(value) for value in np.array(rows).max(axis=0)]


class WorldsSection:
    """The part of a reproduction that runs some of these worlds, `short` in `worlds.yaml`."""

    name = "worlds"
    files = _FILES

    def run(self, out: Path, jobs: int, overrides: Sequence[str]) -> SectionResult:
        """Runs the worlds that `out` does not have yet; arguments as of `run_worlds`."""
        data = read_yaml(Path(__file__).with_suffix(".yaml"))
        plan = {**data, "seeds": 1, "only": data["short"]["only"]}
        result = run_worlds(out, jobs=jobs, overrides=overrides, plan=plan)
        return SectionResult(
            self.name,
            data["short"]["summary"],
            data["short"]["text"],
            tuple(result.claims),
            "worlds",
            ("worlds.csv", "worlds.json", _JOURNAL),
            result.failures,
        )
