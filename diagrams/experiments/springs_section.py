"""The orientation springs side by side, as a part of a report: from their laws alone."""

from collections.abc import Sequence
from pathlib import Path

from geoimp_drake.campaigns.reproduction import SectionResult
from geoimp_drake.campaigns.table import table_of
from geoimp_drake.diagrams.experiments.spring_measures import springs_figure, springs_table
from geoimp_drake.output_folder import write_files
from geoimp_drake.simulation.style import figure_contents, figure_files

__all__ = ["SpringsSection"]

_WORDS = ("spring", "moment in C", "source", "note")
_NUMBERS = (
    "Each law with K = diag(4, 10, 2.5) Nm/rad for small turns, written here from its publication "
    "and evaluated without a simulation. A spring of which a closed loop takes work has no "
    "potential. A misaligned moment turns the hand about another axis than the one it was turned "
    "about. A change as the target comes as −Q is a kick, where nobody keeps the sign."
)
_TEXT = (
    "(a) The hand is turned round a closed loop. (b) It is turned about a principal axis of the "
    "stiffness. (c) It is turned on and on. (d) The target is the same, its quaternion changes "
    "sign."
)


class SpringsSection:
    """The part of a benchmark that puts the laws of springs side by side."""

    name = "springs"
    files = figure_files("springs")

    def run(self, out: Path, jobs: int, overrides: Sequence[str]) -> SectionResult:
        """Computes tables and figure, in a second; arguments as of every section."""
        del jobs, overrides
        rows = springs_table()
        numbers = [name for name in rows[0] if name not in _WORDS]
        write_files(out, figure_contents("springs", springs_figure()))
        tables = (
            table_of("What each spring does", rows, ["spring", *numbers], _NUMBERS),
            table_of("Where each spring is from", rows, _WORDS),
        )
        summary = "orientation springs of this library and of others, of the same gains"
        return SectionResult(self.name, summary, _TEXT, (), "springs", (), {}, tables)
