"""Peg in hole at scale: thousands of draws of a program's errors, for several hands.

```
 OUT/samples.csv            a row a sample, with what repeats it (`geoimp sweep` writes it)
 OUT/hands.csv              a row a hand: how its samples ended, and its forces
 OUT/peg_at_scale.png, .pdf maps of the success, and the forces, by hand
 OUT/journal.jsonl          what has finished
```
"""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from geoimp_drake.campaigns.fastest_form import fastest_form
from geoimp_drake.campaigns.reproduction import SectionResult
from geoimp_drake.campaigns.sweep import SWEEP_FILES, run_sweep
from geoimp_drake.campaigns.sweep_plan import SweepPlan
from geoimp_drake.campaigns.table import table_of
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.experiments.peg_at_scale_figure import scale_figure
from geoimp_drake.output_folder import check_folder, write_files
from geoimp_drake.scenario.loading import read_yaml
from geoimp_drake.simulation.claims import Claim, at_least
from geoimp_drake.simulation.style import figure_contents, figure_files

__all__ = ["Hand", "PegAtScaleSection", "ScaleResult", "hands_of", "run_peg_at_scale"]

SCENARIO = Path(__file__).with_suffix(".yaml")
PLAN = Path(__file__).with_name("peg_at_scale_plan.yaml")
QUICK = 0.1  # of the plan's samples

_NAME = "peg_at_scale"
_FILES = (*SWEEP_FILES, "hands.csv", *figure_files(_NAME))

Rows = Sequence[Mapping[str, Any]]


@dataclass(frozen=True)
class Hand:
    """The results of a hand's samples.

    Attributes:
        hand: name of the variant.
        samples: number of samples that ran to their end.
        success: share with a seated peg and small forces, with its 95 % interval.
        low: lower end of that interval.
        high: upper end of that interval.
        seated: share with the peg in, whatever the forces.
        jammed: share whose peg stopped in the hole.
        missed: share whose peg stayed on the mouth.
        stopped: share in which the cell stopped at the sensor's range.
        median_force: median of the largest force [N].
        high_force: the force that 95 % of the samples do not exceed [N].
    """

    hand: str
    samples: int
    success: float
    low: float
    high: float
    seated: float
    jammed: float
    missed: float
    stopped: float
    median_force: float
    high_force: float


@dataclass(frozen=True)
class ScaleResult:
    """The results of the experiment.

    Attributes:
        rows: of all samples.
        hands: the results of each.
        claims: on them.
        failures: errors that stopped samples, by index.
        files: those that were written.
    """

    rows: Rows
    hands: list[Hand]
    claims: list[Claim]
    failures: dict[str, str]
    files: list[Path]


def run_peg_at_scale(
    out: Path,
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    overrides: Sequence[str] = (),
    samples: int | None = None,
) -> ScaleResult:
    """Runs the samples that `out` does not have yet, and writes tables and figures.

    Args:
        out: folder to write into; made if need be.
        jobs: processes on this machine.
        scheduler: address of a Dask scheduler whose workers are used instead.
        overrides: settings of every run.
        samples: their number, instead of the plan's.

    Raises:
        ConfigurationError: an override, the folder or the scheduler cannot be used; nothing has
            been written.
        OutputError: the disk is full.
    """
    check_folder(out, _FILES)
    experiment = get_experiment("peg_in_hole")
    scenario = experiment.scenario((fastest_form(), read_yaml(SCENARIO)), tuple(overrides))
    plan = SweepPlan.read(PLAN, samples=samples)
    swept = run_sweep(experiment, scenario, plan, out, jobs=jobs, scheduler=scheduler)
    whole = [row for row in swept.rows if row["error"] is None]
    hands = hands_of(whole)
    contents: list[tuple[str, bytes | str]] = [("hands.csv", _table(hands))]
    if whole:
        contents += figure_contents(_NAME, scale_figure(whole))
    failures = {str(row["index"]): row["error"] for row in swept.rows if row["error"] is not None}
    files = [*swept.files, *write_files(out, contents)]
    return ScaleResult(swept.rows, hands, _claims(hands, swept.rows), failures, files)


def hands_of(rows: Rows) -> list[Hand]:
    """Returns the results of each hand's samples, from rows without an error."""
    names = dict.fromkeys(str(row["variant"]) for row in rows)
    return [_hand(name, [row for row in rows if row["variant"] == name]) for name in names]


def _hand(name: str, rows: Rows) -> Hand:
    force = np.array([row["peak_force"] for row in rows])
    seated, jammed = _share(rows, "seated"), _share(rows, "jammed")
    range_ = read_yaml(SCENARIO)["until"]["force"]
    return Hand(
        name,
        len(rows),
        _share(rows, "success"),
        *_interval(_share(rows, "success"), len(rows)),
        seated,
        jammed,
        1.0 - seated - jammed,
        float(np.mean(force >= range_)),
        float(np.median(force)),
        float(np.quantile(force, 0.95)),
    )


def _share(rows: Rows, column: str) -> float:
    return float(np.mean([bool(row[column]) for row in rows]))


def _interval(share: float, n: int) -> tuple[float, float]:
    """Returns Wilson's 95 % interval of a share of n samples."""
    z2 = 1.96**2 / n
    middle, half = share + z2 / 2, np.sqrt(z2 * (share * (1 - share) + z2 / 4))
    return float((middle - half) / (1 + z2)), float((middle + half) / (1 + z2))


def _claims(hands: Sequence[Hand], rows: Rows) -> list[Claim]:
    """Returns the claim that samples run, and each hand's success, which is only reported."""
    ran = sum(hand.samples for hand in hands) / len(rows)
    return [
        at_least("share of the samples that ran to their end", ran, 0.99),
        *(at_least(f"{hand.hand}: share of successes", hand.success, -np.inf) for hand in hands),
    ]


def _table(hands: Sequence[Hand]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(Hand.__annotations__), lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(hand) for hand in hands)
    return text.getvalue()


@dataclass(frozen=True)
class PegAtScaleSection:
    """The part of a report that runs it; quick, the first tenth of the samples."""

    quick: bool = False
    scheduler: str | None = None
    samples: int | None = None
    name: str = _NAME
    files: tuple[str, ...] = _FILES

    def run(self, out: Path, jobs: int, overrides: Sequence[str]) -> SectionResult:
        """Runs the samples that `out` does not have yet; arguments as of `run_peg_at_scale`."""
        samples = self.samples
        if self.quick and samples is None:
            samples = round(QUICK * SweepPlan.read(PLAN).samples)
        result = run_peg_at_scale(
            out, jobs=jobs, scheduler=self.scheduler, overrides=overrides, samples=samples
        )
        return SectionResult(
            self.name,
            f"peg in hole, {len(result.rows)} samples of five hands",
            _TEXT,
            tuple(result.claims),
            _NAME,
            ("hands.csv", "samples.csv", "plan.yaml", "scenario.yaml", "journal.jsonl"),
            result.failures,
            (table_of("How the hands did", [_cells(hand) for hand in result.hands], _HEAD),),
        )


def _cells(hand: Hand) -> dict[str, Any]:
    return dict(zip(_HEAD, asdict(hand).values(), strict=True))


_HEAD = (
    "hand",
    "samples",
    "share of successes",
    "95 % interval from",
    "to",
    "peg is in",
    "jammed",
    "stayed on the mouth",
    "cell stopped",
    "largest force, median [N]",
    "95 % of it below [N]",
)
_TEXT = (
    "Every hand gets the same draws of what the program is wrong about, of hole, friction and "
    "speed. Above the share of successes (the peg is in, with at most 50 N and 5 Nm) over how far "
    "the program is off the hole, below over what else is drawn, and the largest force of a sample."
)
