"""Claims against errors of the model, as a table and as a heat map."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.simulation.style import figure_style

__all__ = ["Cell", "Matrix", "World", "heat_map", "matrix_of", "table"]

_COLOURS = ("#EE9988", "#F4C27A", "#DDE28A", "#9FD3A4")


@dataclass(frozen=True)
class World:
    """One run: an experiment with one error of one size, or with a seed of a mix."""

    experiment: str
    error: str
    size: str
    seed: int
    scenario: dict[str, Any]

    @property
    def key(self) -> str:
        """Name of the run in the journal."""
        return f"{self.experiment}/{self.error}/{self.size}/{self.seed}"


@dataclass(frozen=True)
class Cell:
    """The verdict on a claim under an error: in words, and the share of runs that keep it."""

    words: str
    share: float | None


# By experiment and claim, then by error.
Matrix = Mapping[tuple[str, str], Mapping[str, Cell]]

_NOT_RUN = Cell("", None)


def matrix_of(runs: Mapping[str, World], results: Mapping[str, Any]) -> Matrix:
    """Returns a cell for each claim of an experiment and each error.

    Args:
        runs: by key.
        results: of `run_world` by key, None for a run that could not start.
    """
    found: dict[tuple[str, str], dict[str, list[tuple[str, bool | None]]]] = {}
    names = {
        (world.experiment, claim["claim"]): claim
        for key, world in runs.items()
        for claim in (results[key] or {"claims": []})["claims"]
    }
    for key, world in runs.items():
        result = results[key] or {"claims": []}
        holds = {claim["claim"]: claim["holds"] for claim in result["claims"]}
        for experiment, claim in names:
            if experiment == world.experiment:
                cells = found.setdefault((experiment, claim), {})
                cells.setdefault(world.error, []).append((world.size, holds.get(claim)))
    return {
        row: {error: _cell(sizes) for error, sizes in cells.items()} for row, cells in found.items()
    }


def _cell(runs: Sequence[tuple[str, bool | None]]) -> Cell:
    """Returns the verdict on a claim from the runs of an error, in growing sizes, or of a mix."""
    verdicts = [holds for _, holds in runs]
    if all(holds is None for holds in verdicts):
        return Cell("–", None)
    kept = [holds is True for holds in verdicts]
    share = sum(kept) / len(kept)
    if len({size for size, _ in runs}) < len(runs):
        return Cell(f"{sum(kept)} of {len(kept)}", share)
    until = kept.index(False) if False in kept else len(kept)
    words = "holds" if until == len(kept) else f"to {runs[until - 1][0]}" if until else "fails"
    return Cell(words, until / len(kept))


def table(matrix: Matrix) -> str:
    """Returns the matrix as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    errors = list(dict.fromkeys(error for cells in matrix.values() for error in cells))
    writer.writerow(["experiment", "claim", *errors])
    for (experiment, claim), cells in matrix.items():
        writer.writerow(
            [experiment, claim, *(cells.get(error, _NOT_RUN).words for error in errors)]
        )
    return text.getvalue()


def heat_map(matrix: Matrix) -> Figure:
    """Returns the matrix in colours: red for failed, green for held at every size or seed."""
    from matplotlib.colors import LinearSegmentedColormap

    errors = list(dict.fromkeys(error for cells in matrix.values() for error in cells))
    shares = np.array(
        [
            [np.nan if (s := cells.get(error, _NOT_RUN).share) is None else s for error in errors]
            for cells in matrix.values()
        ]
    )
    with figure_style():
        figure = Figure(figsize=(4.5 + 0.85 * len(errors), 1.6 + 0.24 * len(matrix)))
        axes = figure.subplots()
        colours = LinearSegmentedColormap.from_list("verdicts", _COLOURS)
        axes.imshow(shares, cmap=colours, vmin=0.0, vmax=1.0, aspect="auto")
        for row, cells in enumerate(matrix.values()):
            for column, error in enumerate(errors):
                words = cells.get(error, _NOT_RUN).words
                axes.text(column, row, words, ha="center", va="center", fontsize=5.5)
        axes.set_xticks(range(len(errors)), errors, rotation=40, ha="left", fontsize=7)
        axes.xaxis.tick_top()
        rows = [f"{experiment}: {claim}" for experiment, claim in matrix]
        axes.set_yticks(range(len(rows)), rows, fontsize=6)
        axes.grid(visible=False)
        axes.set_title("worlds: which claims stand, and to what size of an error")
    return figure
