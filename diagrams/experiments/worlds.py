"""Every experiment in worlds that are not its controller's model: which claims stand, and how far.

```
 OUT/worlds.csv           claim × error: holds, to what size, or fails; of a mix, of how many seeds
 OUT/worlds.png, .pdf     the same as a heat map
 OUT/worlds.json          what is claimed of the deviations, with values and bounds
 OUT/journal.jsonl        what has finished
```
"""

import csv
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.campaigns.fastest_form import fastest_form
from geoimp_drake.campaigns.journal import Finished
from geoimp_drake.campaigns.many_runs import run_many
from geoimp_drake.diagrams.experiments.catalogue import Experiment, get_experiment
from geoimp_drake.diagrams.experiments.measures import Log, true_motion
from geoimp_drake.errors import one_line
from geoimp_drake.output_folder import check_folder, write_files
from geoimp_drake.scenario.loading import plain_data, read_yaml
from geoimp_drake.simulation.claims import Claim, at_most, last_second
from geoimp_drake.simulation.experiment import versions
from geoimp_drake.simulation.run import simulate
from geoimp_drake.simulation.style import figure_contents, figure_files, figure_style
from geoimp_drake.systems.frame_motion import POSITION

__all__ = ["Cell", "World", "WorldsResult", "run_world", "run_worlds", "worlds"]

_JOURNAL = "journal.jsonl"
_FILES = (_JOURNAL, "worlds.csv", "worlds.json", *figure_files("worlds"))
_FIELDS = {"claims": list, "deviation": list, "failure": str | None}
_COLOURS = ("#EE9988", "#F4C27A", "#DDE28A", "#9FD3A4")
_FORCE, _STIFFNESS = (
    "at rest f = K_p Δp_de, true f and E, relative error",
    "normal force over depth",
)

# Of plexiglas, by error and size: most of E off C at rest and ever [mm], and of the relative errors
# of force and stiffness.
_BOUNDS = {
    ("masses", "+10 %"): (0.6, 0.6, 0.01, 0.03),
    ("Coulomb friction", "2 %"): (4.0, 4.0, 0.05, 0.03),
    ("mild", ""): (1.5, 3.0, 0.04, 0.03),
    ("rough", ""): (6.0, 10.0, 0.12, 0.1),
}


@dataclass(frozen=True)
class World:
    """One run: an experiment with one error of one size, or with a seed of a mix."""

    experiment: str
    error: str
    size: str
    seed: int
    scenario: dict[str, Any]

    @property
    def key(self) -> str:
        """Name of the run in the journal."""
        return f"{self.experiment}/{self.error}/{self.size}/{self.seed}"


@dataclass(frozen=True)
class Cell:
    """How a claim fares with an error: in words, and which share of its runs keeps it."""

    words: str
    share: float | None


@dataclass(frozen=True)
class WorldsResult:
    """What the experiment left.

    Attributes:
        matrix: by experiment and claim, then by error.
        claims: on the deviations.
        failures: what stopped a run, by its key.
        files: that were written.
    """

    matrix: Mapping[tuple[str, str], Mapping[str, Cell]]
    claims: list[Claim]
    failures: dict[str, str]
    files: list[Path]


def worlds(plan: Mapping[str, Any], overrides: Sequence[str] = ()) -> Iterator[World]:
    """Yields every run of a plan, `worlds.yaml` as data; overrides are those of all runs."""
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
    """Returns the run's `claims`, E's `deviation` from C at rest and ever [mm], and `failure`."""
    experiment = get_experiment(world.experiment)
    scenario = experiment.scenario((world.scenario,))
    setup = experiment.build(scenario)
    outcome = simulate(setup.diagram, scenario.simulator, scenario.duration, events=setup.events)
    log = setup.recorder.collect(outcome.context)
    claims = [claim.as_dict() for claim in experiment.claims(log, scenario)]
    failure = None if outcome.failure is None else one_line(outcome.failure)
    return {"claims": claims, "deviation": _deviation(log, scenario.compliant), "failure": failure}


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
    """Runs what `out` does not have yet, and writes table, heat map and claims.

    Args:
        out: folder to write into; made if need be.
        jobs: processes on this machine.
        overrides: settings of every run.
        plan: what is run; `worlds.yaml` beside this file by default.

    Raises:
        ConfigurationError: an override or the folder cannot be used; nothing has been written.
        OutputError: the disk is full.
    """
    check_folder(out, _FILES)
    plan = plan or read_yaml(Path(__file__).with_suffix(".yaml"))
    runs = {world.key: world for world in worlds(plan, overrides)}
    finished = run_many(
        runs,
        run_world,
        jobs=jobs,
        journal=out / _JOURNAL,
        # With other seeds or fewer experiments what has finished stays.
        plan={"errors": plan["errors"], "mixes": plan["mixes"], "overrides": list(overrides)}
        | {"versions": versions()},
        label="geoimp run worlds",
        fields=_FIELDS,
    )
    matrix = _matrix(runs, finished)
    claims = _claims(runs, finished)
    contents: list[tuple[str, bytes | str]] = [
        ("worlds.csv", _table(matrix)),
        (
            "worlds.json",
            json.dumps([one.as_dict() for one in claims], indent=2, ensure_ascii=False),
        ),
        *figure_contents("worlds", _heat_map(matrix)),
    ]
    failures = {
        key: ended.error or ended.result["failure"]
        for key, ended in finished.items()
        if ended.error or ended.result["failure"]
    }
    return WorldsResult(matrix, claims, failures, write_files(out, contents))


def _matrix(
    runs: Mapping[str, World], finished: Mapping[str, Finished]
) -> dict[tuple[str, str], dict[str, Cell]]:
    """Returns a cell for each claim of an experiment and each error."""
    found: dict[tuple[str, str], dict[str, list[tuple[str, bool | None]]]] = {}
    names = {
        (world.experiment, claim["claim"]): claim
        for key, world in runs.items()
        for claim in (finished[key].result or {"claims": []})["claims"]
    }
    for key, world in runs.items():
        result = finished[key].result or {"claims": []}
        holds = {claim["claim"]: claim["holds"] for claim in result["claims"]}
        for experiment, claim in names:
            if experiment == world.experiment:
                cells = found.setdefault((experiment, claim), {})
                cells.setdefault(world.error, []).append((world.size, holds.get(claim)))
    return {
        row: {error: _cell(sizes) for error, sizes in cells.items()} for row, cells in found.items()
    }


def _cell(runs: Sequence[tuple[str, bool | None]]) -> Cell:
    """Returns how a claim fares in the runs of an error, whose sizes grow, or of a mix."""
    verdicts = [holds for _, holds in runs]
    if all(holds is None for holds in verdicts):
        return Cell("–", None)
    kept = [holds is True for holds in verdicts]
    share = sum(kept) / len(kept)
    if len({size for size, _ in runs}) < len(runs):
        return Cell(f"{sum(kept)} of {len(kept)}", share)
    until = kept.index(False) if False in kept else len(kept)
    words = "holds" if until == len(kept) else f"to {runs[until - 1][0]}" if until else "fails"
    return Cell(words, until / len(kept))


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


def _table(matrix: Mapping[tuple[str, str], Mapping[str, Cell]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    errors = list(dict.fromkeys(error for cells in matrix.values() for error in cells))
    writer.writerow(["experiment", "claim", *errors])
    for (experiment, claim), cells in matrix.items():
        writer.writerow([experiment, claim, *(cells[error].words for error in errors)])
    return text.getvalue()


def _heat_map(matrix: Mapping[tuple[str, str], Mapping[str, Cell]]) -> Figure:
    """Returns the matrix in colours: red fails, green holds at every size or seed."""
    from matplotlib.colors import LinearSegmentedColormap

    errors = list(dict.fromkeys(error for cells in matrix.values() for error in cells))
    shares = np.array(
        [
            [np.nan if (s := cells[error].share) is None else s for error in errors]
            for cells in matrix.values()
        ]
    )
    with figure_style():
        figure = Figure(figsize=(4.5 + 0.85 * len(errors), 1.6 + 0.24 * len(matrix)))
        axes = figure.subplots()
        colours = LinearSegmentedColormap.from_list("verdicts", _COLOURS)
        axes.imshow(shares, cmap=colours, vmin=0.0, vmax=1.0, aspect="auto")
        for row, cells in enumerate(matrix.values()):
            for column, error in enumerate(errors):
                axes.text(column, row, cells[error].words, ha="center", va="center", fontsize=5.5)
        axes.set_xticks(range(len(errors)), errors, rotation=40, ha="left", fontsize=7)
        axes.xaxis.tick_top()
        rows = [f"{experiment}: {claim}" for experiment, claim in matrix]
        axes.set_yticks(range(len(rows)), rows, fontsize=6)
        axes.grid(visible=False)
        axes.set_title("worlds: which claims stand, and to what size of an error")
    return figure
