"""Published numbers and this library's, as a table and as a figure."""

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from geoimp_drake.campaigns.table import Table, cell_of
from geoimp_drake.simulation.style import figure_style

__all__ = ["Row", "figure", "report_table", "rows_of", "table"]

_OURS = "this library"


@dataclass(frozen=True)
class Row:
    """One number of one metric.

    Attributes:
        metric: key in `published_metrics.yaml`.
        value: in the metric's unit.
        of: the published controller, or our run.
        conditions: those of the measurement.
        source: its publication; empty for ours.
        read: the part of the source that was read.
    """

    metric: str
    value: float
    of: str
    conditions: str
    source: str = ""
    read: str = ""


def rows_of(plan: Mapping[str, Any], values: Mapping[str, Mapping[str, float]]) -> list[Row]:
    """Returns every number, metric by metric, theirs before ours.

    Args:
        plan: `published_metrics.yaml` as data.
        values: of our runs, by name and metric.
    """
    return [row for metric in plan["metrics"] for row in _rows(plan, values, metric)]


def _rows(
    plan: Mapping[str, Any], values: Mapping[str, Mapping[str, float]], metric: str
) -> Iterator[Row]:
    for one in plan["published"]:
        if one["metric"] == metric:
            source = plan["sources"][one["source"]]
            theirs = one["value"], one["of"], one["conditions"], source["cited"], source["read"]
            yield Row(metric, *theirs)
    for name, own in values.items():
        if metric in own:
            of, conditions = f"{_OURS}, {name}", plan["runs"][name]["conditions"]
            yield Row(metric, own[metric], of, conditions)


def table(plan: Mapping[str, Any], rows: Sequence[Row]) -> str:
    """Returns the rows as CSV, each with the differences that forbid a comparison."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = ("metric", "value", "unit", "of", "conditions", "source", "read", "not comparable")
    writer.writerow(names)
    for row in rows:
        metric = plan["metrics"][row.metric]
        number = f"{row.value:.4g}"
        cells = number, metric["unit"], row.of, row.conditions, row.source, row.read
        writer.writerow((metric["name"], *cells, metric["differs"]))
    return text.getvalue()


def report_table(plan: Mapping[str, Any], rows: Sequence[Row]) -> Table:
    """Returns one row for each metric: the published numbers, ours, and their differences."""
    cells = []
    for name, metric in plan["metrics"].items():
        own = [row for row in rows if row.metric == name]
        theirs = "; ".join(f"{row.value:.4g}, {row.of}, {row.source}" for row in own if row.source)
        ours = "; ".join(
            f"{cell_of(row.value)}, {row.of.removeprefix(f'{_OURS}, ')}"
            for row in own
            if not row.source
        )
        title = f"{metric['name']} [{metric['unit']}]"
        cells.append((title, theirs or "none found", ours or "–", metric["differs"]))
    head = ("metric", "published", "ours", "not comparable")
    return Table("Published numbers and ours", head, tuple(cells), plan["text"])


def figure(plan: Mapping[str, Any], rows: Sequence[Row]) -> Figure:
    """Returns one panel for each comparable metric, with one bar for each number."""
    shown = [name for name, metric in plan["metrics"].items() if metric.get("panel", True)]
    lines = -(-len(shown) // 2)
    with figure_style():
        drawn = Figure(figsize=(12.0, 1.5 * lines + 0.6), layout="constrained")
        panels = drawn.subplots(lines, 2, squeeze=False).ravel()
        for axes, name in zip(panels, shown, strict=False):
            metric = plan["metrics"][name]
            _plot(axes, [row for row in rows if row.metric == name])
            axes.set_title(f"{metric['name']} [{metric['unit']}]")
        for axes in panels[len(shown) :]:
            axes.set_visible(False)
        drawn.suptitle("metrics that others publish: theirs grey, this library's blue")
    return drawn


def _plot(axes: Axes, rows: Sequence[Row]) -> None:
    values = [row.value for row in rows]
    bars = axes.barh(range(len(rows)), values, color=[_colour(row) for row in rows])
    axes.bar_label(bars, [f"{value:.4g}" for value in values], padding=3, fontsize=7)
    axes.set_yticks(range(len(rows)), [row.of for row in rows], fontsize=7)
    axes.invert_yaxis()
    axes.set_xlim(0.0, 1.15 * max(values, default=0.0) or 1.0)


def _colour(row: Row) -> str:
    return "#999999" if row.source else "#0072B2"
