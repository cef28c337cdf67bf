"""A table of a report, and the report's page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

__all__ = ["Cell", "Page", "Table", "cell_of", "table_of"]

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
    """Returns some columns of rows as a table of cells as of `cell_of`.

    Args:
        title: above the table.
        rows: values by column.
        columns: the columns to show.
        text: what was done.
    """
    cells = tuple(tuple(cell_of(row[name]) for name in columns) for row in rows)
    return Table(title, tuple(columns), cells, text)


def cell_of(value: str | float | None) -> str:
    """Returns text as it is, a number in three digits without an exponent, a dash for none.

    A number below a thousandth but not zero is shown as just that, so that nobody compares
    roundings.

    Args:
        value: text, a number, or None for none.
    """
    if value is None:
        return "–"
    if not isinstance(value, float):
        return str(value)
    if 0.0 < abs(value) < 1e-3:
        return "< 0.001"
    return f"{value:.0f}" if abs(value) >= 100.0 else f"{value:.3g}"


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
