"""The parts of `geoimp benchmark`: this library beside others on the same work."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from geoimp_drake.campaigns.reproduction import Section
from geoimp_drake.campaigns.study import Study
from geoimp_drake.campaigns.table import Cell, Page, Table
from geoimp_drake.diagrams.experiments.peer_speed import SpeedSection
from geoimp_drake.diagrams.experiments.peg_at_scale import PegAtScaleSection
from geoimp_drake.diagrams.experiments.published_metrics import PublishedMetricsSection
from geoimp_drake.diagrams.experiments.reproduction import get_study
from geoimp_drake.diagrams.experiments.springs_section import SpringsSection
from geoimp_drake.scenario.loading import read_yaml

__all__ = ["page", "parts"]

_QUICK = ("exact", "mass-10", "friction-1")  # errors under which every scheme is run
_QUICK_SPRINGS = ("quaternion", "axis-angle")


def page() -> Page:
    """Returns the report's first part: what to use when."""
    data = read_yaml(Path(__file__).with_suffix(".yaml"))
    tables = tuple(_table(table, data["documentation"]) for table in data["tables"])
    return Page("benchmark", data["title"], tables, folded=True)


def parts(*, quick: bool, scheduler: str | None = None) -> dict[str, Study | Section]:
    """Returns all parts to run, by the name of their folder.

    Args:
        quick: fewer errors, cases and samples.
        scheduler: address of a Dask scheduler whose workers run the samples of the peg in hole.
    """
    every: list[Study | Section] = [
        _part(get_study("orientation_loop"), _QUICK_SPRINGS if quick else None),
        replace(_part(get_study("disturbance"), _QUICK if quick else None), name="schemes"),
        SpringsSection(),
        PegAtScaleSection(quick, scheduler),
        SpeedSection(quick),
        PublishedMetricsSection(),
    ]
    return {part.name: part for part in every}


def _part(study: Study, endings: tuple[str, ...] | None) -> Study:
    """Returns a study of `geoimp reproduce` with the variants of these endings; None for all."""
    variants = tuple(v for v in study.variants if endings is None or v.name.endswith(endings))
    return replace(study, variants=variants, compared=tuple(v.name for v in variants))


def _table(data: dict[str, Any], address: str) -> Table:
    """Returns a table; a list as cell is a link to a page of the documentation."""
    rows = tuple(tuple(_cell(cell, address) for cell in row) for row in data["rows"])
    return Table(data["title"], tuple(data["head"]), rows, data.get("text", ""))


def _cell(cell: str | list[str], address: str) -> Cell:
    if isinstance(cell, str):
        return cell
    words, page = cell
    return words, f"{address}/{page}"
