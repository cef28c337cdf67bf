"""An experiment with parameters drawn at random: many runs, one table."""

import csv
import io
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from matplotlib.figure import Figure

from geoimp_drake.campaigns.journal import Finished
from geoimp_drake.campaigns.many_runs import run_many
from geoimp_drake.campaigns.sweep_figures import peaks_figure, success_map
from geoimp_drake.campaigns.sweep_plan import Draw, SweepPlan, setting
from geoimp_drake.campaigns.sweep_sample import SAMPLE_FIELDS, Sample, run_sample
from geoimp_drake.errors import ConfigurationError, GeoimpError
from geoimp_drake.output_folder import check_folder, write_files
from geoimp_drake.scenario.loading import dump_scenario, list_index, plain_data
from geoimp_drake.simulation.style import figure_contents, figure_files
from geoimp_drake.validation import choice, quoted

__all__ = ["SWEEP_FILES", "SweepResult", "format_sweep", "run_sweep"]

TABLE, JOURNAL, SCENARIO = "samples.csv", "journal.jsonl", "scenario.yaml"
SWEEP_FILES = (
    TABLE,
    JOURNAL,
    SCENARIO,
    "plan.yaml",
    *figure_files("success_map", "peak_forces"),
)


@dataclass
class SweepResult:
    """The results of a sweep.

    Attributes:
        rows: of the table, by index; a failed sample lacks values.
        files: those that were written.
    """

    rows: list[dict[str, Any]]
    files: list[Path]

    @property
    def errors(self) -> int:
        """Number of samples that ended with an error."""
        return sum(row["error"] is not None for row in self.rows)


def run_sweep(
    experiment: Any,
    scenario: Any,
    plan: SweepPlan,
    out: Path,
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    map_keys: Sequence[str] = (),
) -> SweepResult:
    """Runs every sample of a plan that `out` does not have yet, and writes the table and figures.

    The table does not depend on the number of jobs, nor on how often the sweep was interrupted.

    Args:
        experiment: from the catalogue.
        scenario: the one that all samples have in common.
        plan: the draws.
        out: folder to write into; made if need be.
        jobs: processes on this machine.
        scheduler: address of a Dask scheduler whose workers are used instead.
        map_keys: the two varied keys of the map; by default the first two.

    Raises:
        ConfigurationError: the plan, the folder or the scheduler cannot be used; nothing has been
            written.
    """
    plan.validate()
    check_folder(out, SWEEP_FILES)
    map_keys = _map_keys(plan, map_keys)
    data = plain_data(scenario)
    _check_values(experiment, data, plan)
    draws = [plan.draw(index) for index in range(plan.samples)]
    finished = run_many(
        {str(draw.index): Sample(experiment, data, draw.overrides()) for draw in draws},
        run_sample,
        jobs=jobs,
        journal=out / JOURNAL,
        plan=_identity(experiment, data, plan),
        scheduler=scheduler,
        label="geoimp sweep",
        fields=SAMPLE_FIELDS,
    )
    rows = [_row(draw, finished[str(draw.index)]) for draw in draws]
    contents: list[tuple[str, bytes | str]] = [
        (SCENARIO, dump_scenario(scenario)),
        ("plan.yaml", _dump(plan)),
        (TABLE, _table(rows)),
    ]
    for name, figure in _figures(experiment.name, rows, map_keys).items():
        contents += figure_contents(name, figure)
    return SweepResult(rows, write_files(out, contents))


def format_sweep(name: str, result: SweepResult, out: Path) -> str:
    """Returns the summary of a sweep for a terminal.

    Args:
        name: of the experiment.
        result: of its sweep.
        out: the sweep's folder.
    """
    rows = result.rows
    wins = sum(row["success"] for row in rows)
    return "\n".join(
        (
            f"{name}: {wins} of {len(rows)} samples succeed ({100 * wins / len(rows):.1f} %), "
            f"{result.errors} with an error",
            _peaks(rows, "peak_force", "largest force", "N"),
            _peaks(rows, "peak_moment", "largest moment", "Nm"),
            *_first_error(rows),
            f"to repeat a row, here the first: {_command(name, rows[0], out)}",
        )
    )


def _map_keys(plan: SweepPlan, keys: Sequence[str]) -> Sequence[str]:
    """Returns the columns of the map; with one varied key, the forces over it."""
    for key in keys:
        choice(key, "key of the map", plan.vary)
    return tuple(keys) or (*plan.vary, "peak_force")[:2]


def _check_values(experiment: Any, data: dict[str, Any], plan: SweepPlan) -> None:
    """Raises ConfigurationError if a variant, or a varied key's number, cannot be used."""
    for name, settings in plan.variants.items():
        try:
            experiment.scenario((data,), settings)
        except GeoimpError as error:
            raise ConfigurationError(f"variant {quoted(name)}: {error}") from None
    first = plan.draw(0).parameters
    for key, distribution in plan.vary.items():
        value = _value_at(data, key)
        if isinstance(value, str | bool):
            raise ConfigurationError(
                f"{key} is {quoted(value)}, not a number; it cannot be varied."
            )
        for value in (*distribution.typical(), first[key]):
            try:
                experiment.scenario((data,), (setting(key, value),))
            except GeoimpError as error:
                raise ConfigurationError(f"{key} cannot be {value:g}: {error}") from None


def _value_at(data: Any, key: str) -> Any:
    """Returns the value at a path in a scenario's data; None if there is no path or no value."""
    for part in key.split("."):
        if isinstance(data, list) and (index := list_index(part, data)) is not None:
            data = data[index]
        else:
            data = data.get(part) if isinstance(data, dict) else None
    return data


def _identity(experiment: Any, data: dict[str, Any], plan: SweepPlan) -> dict[str, Any]:
    """Returns all on which a sample depends besides its index."""
    drawn = {key: value for key, value in plan.as_data().items() if key != "samples"}
    return {
        "experiment": experiment.name,
        **drawn,
        "scenario": data,
        "versions": {name: version(name) for name in ("geoimp-drake", "drake", "numpy")},
    }


def _row(draw: Draw, finished: Finished) -> dict[str, Any]:
    result = finished.result or {}
    return {
        "index": draw.index,
        "seed": draw.seed,
        **({"variant": draw.variant} if draw.variant is not None else {}),
        **draw.parameters,
        "success": result.get("success", False),
        "peak_force": result.get("peak_force"),
        "peak_moment": result.get("peak_moment"),
        "error": finished.error or result.get("failure"),
        **result.get("values", {}),
        "arguments": shlex.join(_arguments(draw)),
    }


def _arguments(draw: Draw) -> list[str]:
    """Returns the arguments of `geoimp run` that repeat a sample, within the sweep's folder."""
    settings = [part for text in draw.overrides() for part in ("--set", text)]
    return ["--scenario", SCENARIO, *settings]


def _command(name: str, row: dict[str, Any], out: Path) -> str:
    arguments = row["arguments"].removeprefix(f"--scenario {SCENARIO} ")
    return f"geoimp run {name} --scenario {shlex.quote(str(out / SCENARIO))} {arguments}"


def _table(rows: list[dict[str, Any]]) -> str:
    # Failed samples lack the values; `arguments` stays last.
    columns = list(dict.fromkeys(name for row in rows for name in row if name != "arguments"))
    text = io.StringIO()
    writer = csv.DictWriter(text, [*columns, "arguments"], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _dump(plan: SweepPlan) -> str:
    return yaml.safe_dump(plan.as_data(), sort_keys=False, allow_unicode=True)


def _figures(name: str, rows: list[dict[str, Any]], keys: Sequence[str]) -> dict[str, Figure]:
    # A sample without a peak force has no place on that axis.
    drawn = [row for row in rows if all(_is_finite(row[key]) for key in keys)]
    figures = {"peak_forces": peaks_figure(rows, name)}
    return {"success_map": success_map(drawn, keys, name), **figures} if drawn else figures


def _is_finite(value: float | None) -> bool:
    return value is not None and bool(np.isfinite(value))


def _peaks(rows: list[dict[str, Any]], column: str, label: str, unit: str) -> str:
    values = np.array([row[column] for row in rows if row[column] is not None], dtype=float)
    if not values.size:
        return f"{label}: no sample has run"
    return f"{label}: median {np.median(values):.4g} {unit}, most {values.max():.4g} {unit}"


def _first_error(rows: list[dict[str, Any]]) -> list[str]:
    errors = [row for row in rows if row["error"] is not None]
    return [f"first error, sample {row['index']}: {row['error']}" for row in errors[:1]]
