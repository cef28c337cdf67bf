"""The page about a reproduction: opens from its folder, without a network."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from geoimp_drake.campaigns.reproduction import (
    CONTRAST,
    Judged,
    Reproduction,
    SectionResult,
    StudyResult,
    VariantResult,
)
from geoimp_drake.campaigns.table import Page, Table
from geoimp_drake.extras import needs_extra
from geoimp_drake.output_folder import write_file
from geoimp_drake.simulation.claims import FAILS, HOLDS, NOT_REACHED, REPORTED
from geoimp_drake.simulation.energy_audit import AUDIT, AUDIT_TEXT
from geoimp_drake.simulation.experiment import versions

__all__ = ["REPORT", "check_report", "write_report"]

REPORT = "report.html"

_TEMPLATE = Path(__file__).with_name("report.html.jinja")
_STYLES = {
    HOLDS: "holds",
    FAILS: "fails",
    CONTRAST: "contrast",
    NOT_REACHED: "open",
    REPORTED: "open",
}
# The files of a run besides figures, with the words of their links.
_LINKS = {
    "replay.html": "replay",
    "log.npz": "log",
    "scenario.yaml": "scenario",
    "metrics.json": "metrics",
}


def check_report(label: str) -> None:
    """Raises ConfigurationError if the template library, an extra, is missing."""
    with needs_extra("report", label):
        import jinja2  # noqa: F401  (an extra: imported only where it is used)


def write_report(reproduction: Reproduction, folder: Path, page: Page) -> None:
    """Writes the page; figures and files are linked relative to its folder.

    Nothing in it depends on dates or speeds: the same results give the same page.

    Args:
        reproduction: its results.
        folder: to write into.
        page: its title and further contents.
    """
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_TEMPLATE.parent),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    contents = {**_contents(reproduction), "page": page, "page_tables": _tables(page.tables)}
    write_file(folder / REPORT, environment.get_template(_TEMPLATE.name).render(contents))


def _contents(reproduction: Reproduction) -> dict[str, Any]:
    """Returns the data for the template."""
    counts = reproduction.count()
    return {
        "counts": [
            (verdict, style, counts[verdict])
            for verdict, style in _STYLES.items()
            if counts[verdict] or verdict != REPORTED
        ],
        "failures": reproduction.failures(),
        "sections": [
            *(_section(study) for study in reproduction.studies),
            *(_other_section(result) for result in reproduction.sections),
        ],
        "versions": versions(),
        "seeds": reproduction.seeds(),
        "duration": reproduction.duration,
    }


def _section(result: StudyResult) -> dict[str, Any]:
    name = result.study.name
    return {
        "name": name,
        "summary": result.study.experiment.summary,
        "runs": [_run(name, variant) for variant in result.variants],
        "comparison": _comparison(result),
    }


def _other_section(result: SectionResult) -> dict[str, Any]:
    figures = {result.figure: result.text} if result.figure else {}
    figures |= result.more_figures
    matter = {
        "title": "all runs",
        "text": "" if result.figure else result.text,
        "figures": [
            _figure(_words(name), f"{result.name}/{name}", text) for name, text in figures.items()
        ],
        "tables": _tables(result.tables),
        "links": [(file, f"{result.name}/{file}") for file in result.files],
        "claims": [_row(judged) for judged in result.judged()],
    }
    return {"name": result.name, "summary": result.summary, "runs": [], "comparison": matter}


def _run(experiment: str, result: VariantResult) -> dict[str, Any]:
    folder = f"{experiment}/{result.variant.name}"
    figures = {**result.variant.figures, AUDIT: AUDIT_TEXT}
    return {
        "name": result.variant.name,
        "title": result.variant.title,
        "failure": result.failure,
        "figures": [
            _figure(_words(name), f"{folder}/{name}", text)
            for name, text in figures.items()
            if f"{name}.png" in result.files
        ],
        "links": [
            (words, f"{folder}/{file}") for file, words in _LINKS.items() if file in result.files
        ],
        "claims": [_row(judged) for judged in result.judged()],
    }


def _comparison(result: StudyResult) -> dict[str, Any] | None:
    if not result.files:
        return None
    stem = f"{result.study.name}/comparison"
    return {
        "title": f"{result.study.kind} compared",
        "text": "",
        "figures": [_figure("Comparison", stem, result.study.text)],
        "tables": _tables(result.tables),
        "links": [("metrics", f"{stem}.json")],
        "claims": [_row(judged) for judged in result.judged_across()],
    }


def _tables(tables: Iterable[Table]) -> list[dict[str, Any]]:
    """Returns tables; every cell has words and the address of a link, if there is one."""
    return [
        {
            "title": table.title,
            "head": table.head,
            "rows": [
                [(cell, "") if isinstance(cell, str) else cell for cell in row]
                for row in table.rows
            ],
            "text": table.text,
        }
        for table in tables
    ]


def _figure(title: str, stem: str, text: str) -> dict[str, str]:
    return {"title": title, "png": f"{stem}.png", "pdf": f"{stem}.pdf", "text": text}


def _words(name: str) -> str:
    """Returns `Figure 5.3` for figure_5_3, and `Peg at scale` for peg_at_scale."""
    return re.sub("(?<=[0-9])_(?=[0-9])", ".", name).replace("_", " ").capitalize()


def _row(judged: Judged) -> dict[str, str]:
    return {
        "claim": judged.claim.claim,
        "value": judged.claim.value_text,
        "bound": judged.claim.bound_text,
        "verdict": judged.verdict,
        "style": _STYLES[judged.verdict],
        "reason": judged.reason,
    }
