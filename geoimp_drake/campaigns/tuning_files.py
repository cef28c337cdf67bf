"""The output of a tuning: tuned.yaml, tuning.json and figures, and a table for a terminal."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.analysis.contact_model import GAINS
from geoimp_drake.analysis.tuning import UNITS
from geoimp_drake.campaigns.tuning import Side, TuningResult
from geoimp_drake.campaigns.tuning_trials import JOURNAL
from geoimp_drake.output_folder import write_files
from geoimp_drake.scenario.loading import dump_scenario
from geoimp_drake.simulation.style import figure_contents, figure_files, figure_style

__all__ = ["TUNING_FILES", "format_tuning", "front_figure", "tuning_figure", "write_tuning"]

_SCENARIO, _DATA, _FIGURE, _FRONT = "tuned.yaml", "tuning.json", "tuning", "front"
TUNING_FILES = (_SCENARIO, _DATA, JOURNAL, *figure_files(_FIGURE, _FRONT))

_BEFORE, _AFTER = "#666666", "#0072B2"


def write_tuning(name: str, result: TuningResult, out: Path) -> list[Path]:
    """Writes the files of a tuning; `front` only if there were several objectives.

    Args:
        name: of the experiment.
        result: of its tuning.
        out: folder to write into.
    """
    contents: list[tuple[str, bytes | str]] = [
        (_SCENARIO, dump_scenario(result.scenario)),
        (_DATA, json.dumps(_data(name, result), indent=2, ensure_ascii=False) + "\n"),
        *figure_contents(_FIGURE, tuning_figure(name, result)),
    ]
    if len(result.tuning.objectives) > 1:
        contents += figure_contents(_FRONT, front_figure(name, result))
    return write_files(out, contents)


def format_tuning(name: str, result: TuningResult) -> str:
    """Returns the table of a tuning for a terminal.

    Args:
        name: of the experiment.
        result: of its tuning.
    """
    tuning, before, after = result.tuning, result.before, result.after
    rows: list[tuple[str, ...]] = [("", "given", "tuned", "", "")]
    rows += [
        (f"{letter} [{unit}]", _number(before.gains[letter]), _number(after.gains[letter]), "", "")
        for letter, (_, unit) in GAINS.items()
    ]
    rows += [("", "rollout", "", "experiment", ""), ("", "given", "tuned", "given", "tuned")]
    for metric, unit in UNITS.items():
        sides = [
            side.get(metric) for which in ("modelled", "measured") for side in _pair(result, which)
        ]
        rows.append((f"{metric} [{unit}]", *(_number(value) for value in sides)))
    widths = [max(len(row[k]) for row in rows) for k in range(5)]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    kept = ", ".join(map(str, tuning.constraints))
    walls = " and ".join(f"{wall:.4g}" for wall in tuning.walls)
    lines += [f"kept: {kept}; on walls of {walls} N/m"]
    if result.runs:
        lines.append(f"the rollout was off by more than 10 %: {result.runs} runs of {name} decided")
    lines += [f"no longer holds: {claim}" for claim in after.failed if claim not in before.failed]
    return "\n".join(lines)


def _pair(result: TuningResult, which: str) -> list[dict[str, float]]:
    return [getattr(side, which) for side in (result.before, result.after)]


def _number(value: float | None) -> str:
    return "" if value is None else "none" if np.isinf(value) else f"{value:.4g}"


def _data(name: str, result: TuningResult) -> dict[str, Any]:
    tuning = result.tuning
    return {
        "experiment": name,
        "minimize": list(tuning.objectives),
        "subject_to": [str(constraint) for constraint in tuning.constraints],
        "walls": list(tuning.walls),
        "vary": {letter: list(bounds) for letter, bounds in tuning.bounds.items()},
        "seed": tuning.seed,
        "runs": result.runs,
        "before": _side(result.before),
        "after": _side(result.after),
        "front": [
            {**c.gains, **dict(zip(tuning.objectives, c.values, strict=True))} for c in result.front
        ],
    }


def _side(side: Side) -> dict[str, Any]:
    """Returns a side without its curve, for JSON; infinity becomes null."""
    data = {key: value for key, value in asdict(side).items() if key != "force"}
    for part in ("modelled", "measured"):
        data[part] = {k: v if np.isfinite(v) else None for k, v in data[part].items()}
    return data


def tuning_figure(name: str, result: TuningResult) -> Figure:
    """Returns the force over time with the given and the tuned gains, of runs and rollouts."""
    model = result.tuning.model
    with figure_style():
        figure = Figure(figsize=(8, 3.8))
        axes = figure.subplots()
        for side, words, colour in (
            (result.before, "as given", _BEFORE),
            (result.after, "tuned", _AFTER),
        ):
            gains = ", ".join(f"{letter} {value:.4g}" for letter, value in side.gains.items())
            axes.plot(result.times, side.force, color=colour, label=f"{words}: {gains}")
            axes.plot(
                model.encounter.times,
                model.force(side.gains),
                color=colour,
                linestyle=(0, (2, 1.5)),
                label=f"{words}, rollout of the law",
            )
        axes.axvline(model.encounter.rest, color="#BBBBBB", linewidth=0.8)
        axes.annotate("D rests", (model.encounter.rest, 0.0), (3, 3), textcoords="offset points")
        axes.set(xlabel="time [s]", ylabel="force on the wall [N]", title=f"{name}: tuned")
        axes.set_xlim(max(0.0, model.encounter.touch - 1.0), result.times[-1])
        axes.set_ylim(bottom=0.0)
        axes.legend(loc="best")
    return figure


def front_figure(name: str, result: TuningResult) -> Figure:
    """Returns the front, each further objective over the first, with the given and tuned gains."""
    first, *others = result.tuning.objectives
    with figure_style():
        figure = Figure(figsize=(4.8 * len(others), 3.8))
        for k, axes in enumerate(np.atleast_1d(figure.subplots(1, len(others))), 1):
            other = others[k - 1]
            axes.plot(
                [c.values[0] for c in result.front],
                [c.values[k] for c in result.front],
                ".-",
                color=_AFTER,
                label="front of the rollout",
            )
            for side, words, marker in (
                (result.before, "as given", "x"),
                (result.after, "tuned", "o"),
            ):
                axes.plot(
                    side.measured[first],
                    side.measured[other],
                    marker,
                    color="k",
                    fillstyle="none",
                    label=f"{words}, measured",
                )
            axes.set(xlabel=f"{first} [{UNITS[first]}]", ylabel=f"{other} [{UNITS[other]}]")
            axes.legend(loc="best")
        figure.suptitle(f"{name}: what can be had")
    return figure
