"""A table of a report, and the report's page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

__all__ = ["Cell", "Page", "Table", "table_of"]

# Text, or a link: its words and its address.
Cell = str | tuple[str, str]


@dataclass(frozen=True)
class Table:
    """Numbers or words side by side.

    Attributes:
        title: above the table.
        head: headings of its columns.
        rows: of cells, one a column.
        text: what was done, and the basis of the numbers.
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
    """Returns some columns of rows as a table, with three digits a number and a dash for none.

    A number below a thousandth but not zero is shown as just that, so that nobody compares
    roundings.

    Args:
        title: above the table.
        rows: cells by column.
        columns: the columns to show.
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
    """The frame of a report around its results.

    Attributes:
        command: the subcommand of `geoimp` that writes it.
        title: its heading.
        tables: those that stand first.
        folded: put claims last and fold the single runs, for a reader who came for the tables.
    """

    command: str
    title: str
    tables: tuple[Table, ...] = ()
    folded: bool = False
