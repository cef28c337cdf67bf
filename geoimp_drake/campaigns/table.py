"""A table of a report, and the page that it stands on."""

from dataclasses import dataclass

__all__ = ["Cell", "Page", "Table"]

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
