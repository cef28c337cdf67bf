"""The results of a reproduction: runs, comparisons, tables, and the verdict on every claim."""

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, Protocol

from geoimp_drake.campaigns.journal import Finished
from geoimp_drake.campaigns.study import Study, Variant
from geoimp_drake.campaigns.table import Table
from geoimp_drake.simulation.claims import FAILS, HOLDS, NOT_REACHED, REPORTED, Claim

__all__ = [
    "CONTRAST",
    "Judged",
    "Reproduction",
    "Section",
    "SectionResult",
    "StudyResult",
    "VariantResult",
    "format_reproduction",
]

CONTRAST = "broken on purpose"  # by a variant that shows what would happen otherwise


class Judged(NamedTuple):
    """A claim with its verdict, and the reason if it is broken on purpose."""

    claim: Claim
    verdict: str
    reason: str = ""


@dataclass(frozen=True)
class VariantResult:
    """One run.

    Attributes:
        variant: the one that was run.
        folder: of its files.
        files: their names; none if the run could not start.
        claims: judged from its log.
        failure: the error that stopped it, if any.
        seed: of the sensors' noise; None if the run could not start.
    """

    variant: Variant
    folder: Path
    files: tuple[str, ...]
    claims: tuple[Claim, ...]
    failure: str | None
    seed: int | None = None

    @staticmethod
    def of(variant: Variant, parent: Path, finished: Finished) -> "VariantResult":
        """Returns a run as it ended, its claims read from its files."""
        folder = parent / variant.name
        if finished.result is None:
            return VariantResult(variant, folder, (), (), finished.error)
        metrics = json.loads((folder / "metrics.json").read_text("utf-8"))
        claims = tuple(Claim(**claim) for claim in metrics["claims"])
        files, failure = tuple(finished.result["files"]), finished.result["failure"]
        return VariantResult(variant, folder, files, claims, failure, metrics["seed"])

    def judged(self) -> list[Judged]:
        """Returns every claim with its verdict."""
        return [self._judge(claim) for claim in self.claims]

    def _judge(self, claim: Claim) -> Judged:
        reason = self.variant.contrast.get(claim.claim)
        if reason is None or claim.holds is None:
            return Judged(claim, claim.verdict)
        if claim.holds:
            return Judged(claim, FAILS, f"was to be broken: {reason}")
        return Judged(claim, CONTRAST, reason)


@dataclass(frozen=True)
class StudyResult:
    """An experiment with its runs.

    Attributes:
        study: the one that was run.
        variants: its runs.
        across: claims across the runs.
        files: of the comparison.
        tables: across the runs.
    """

    study: Study
    variants: tuple[VariantResult, ...]
    across: tuple[Claim, ...]
    files: tuple[Path, ...]
    tables: tuple[Table, ...] = ()

    def judged_across(self) -> list[Judged]:
        """Returns every claim across the runs with its verdict."""
        return [Judged(claim, claim.verdict) for claim in self.across]


@dataclass(frozen=True)
class SectionResult:
    """A section of its own, not an experiment with variants.

    Attributes:
        name: of its folder.
        summary: in one line.
        text: a description of its figure.
        claims: on all of its runs.
        figure: stem of its file, empty for none.
        files: further linked files.
        failures: the errors that stopped runs, by key.
        tables: of its numbers.
        more_figures: descriptions, by the stem of the figure's file.
    """

    name: str
    summary: str
    text: str
    claims: tuple[Claim, ...]
    figure: str
    files: tuple[str, ...]
    failures: Mapping[str, str]
    tables: tuple[Table, ...] = ()
    more_figures: Mapping[str, str] = field(default_factory=dict)

    def judged(self) -> list[Judged]:
        """Returns every claim with its verdict."""
        return [Judged(claim, claim.verdict) for claim in self.claims]


class Section(Protocol):
    """Makes such a section."""

    @property
    def name(self) -> str:
        """Name of its folder."""

    @property
    def files(self) -> tuple[str, ...]:
        """Files that it may write there."""

    def run(self, out: Path, jobs: int, overrides: Sequence[str]) -> SectionResult:
        """Does the runs that the folder does not have yet, with settings over all scenarios."""


@dataclass(frozen=True)
class Reproduction:
    """The results of a whole reproduction.

    Attributes:
        studies: the experiments with their runs.
        duration: simulated time that was requested instead of the scenarios' own [s].
        sections: the other sections.
    """

    studies: tuple[StudyResult, ...]
    duration: float | None
    sections: tuple[SectionResult, ...] = ()

    def judged(self) -> Iterator[tuple[str, Judged]]:
        """Yields every claim with its verdict, and the run or comparison that it belongs to."""
        for study in self.studies:
            name = study.study.name
            for result in study.variants:
                yield from ((f"{name}/{result.variant.name}", one) for one in result.judged())
            yield from ((f"{name}, compared", one) for one in study.judged_across())
        for section in self.sections:
            yield from ((section.name, one) for one in section.judged())

    def count(self) -> Counter[str]:
        """Returns the number of claims with each verdict."""
        return Counter(judged.verdict for _, judged in self.judged())

    def seeds(self) -> list[int]:
        """Returns the seeds of all runs, each once."""
        results = [result for study in self.studies for result in study.variants]
        return sorted({result.seed for result in results if result.seed is not None})

    def failures(self) -> dict[str, str]:
        """Returns the errors that stopped simulations, by run."""
        of_studies = {
            f"{study.study.name}/{result.variant.name}": result.failure
            for study in self.studies
            for result in study.variants
            if result.failure is not None
        }
        of_sections = {
            f"{section.name}/{key}": failure
            for section in self.sections
            for key, failure in section.failures.items()
        }
        return of_studies | of_sections


def format_reproduction(reproduction: Reproduction) -> str:
    """Returns the summary for a terminal: claims by verdict, and each that fails."""
    counts = reproduction.count()
    order = (HOLDS, FAILS, CONTRAST, NOT_REACHED, REPORTED)
    summary = ", ".join(f"{counts[verdict]} {verdict}" for verdict in order if counts[verdict])
    failing = [
        f"  {run}: {judged.claim.claim}: {judged.claim.value_text}, bound {judged.claim.bound_text}"
        for run, judged in reproduction.judged()
        if judged.verdict == FAILS
    ]
    first = f"{sum(counts.values())} claims: {summary}" if summary else "0 claims"
    return "\n".join((first, *failing))
