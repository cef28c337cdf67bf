"""A table of a report, and the page that it stands on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

__all__ = ["Cell", "Page", "Table", "table_of"]

# Text, or a link: its words and where it leads.
Cell = str | tuple[str, str]


@dataclass(frozen=True)
class Table:
    """Numbers or words side by side.

    Attributes:
        title: above it.
        head: of its columns.
        rows: of cells, one a column.
        text: what was done, and on what the numbers rest.
    """

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    text: str = ""


def table_of(
    title: str,
    rows: Sequence[Mapping[str, str | float | None]],
    columns: Sequence[str],
    text: str = "",
) -> Table:
    """Returns some columns of rows as a table, numbers in three digits, a dash for none.

    What is no zero and below a thousandth is said to be that, so that nobody compares roundings.

    Args:
        title: above it.
        rows: cells by column.
        columns: which of these.
        text: what was done.
    """
    cells = tuple(tuple(_words(row[name]) for name in columns) for row in rows)
    return Table(title, tuple(columns), cells, text)


def _words(value: str | float | None) -> str:
    if value is None:
        return "–"
    if not isinstance(value, float):
        return str(value)
    return "< 0.001" if 0.0 < abs(value) < 1e-3 else f"{value:.3g}"


@dataclass(frozen=True)
class Page:
    """What a report has besides results.

    Attributes:
        command: that writes it, after `geoimp`.
        title: its heading.
        tables: that stand first.
        folded: put claims last and fold the single runs, for a reader who came for the tables.
    """

    command: str
    title: str
    tables: tuple[Table, ...] = ()
    folded: bool = False
