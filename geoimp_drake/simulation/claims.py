"""The claims of an experiment: a value from the log, its bound, and whether it holds."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace

import numpy as np

from geoimp_drake.systems.frame_motion import POSITION
from geoimp_drake.typing import Array

__all__ = [
    "FAILS",
    "HOLDS",
    "NOT_REACHED",
    "REPORTED",
    "Claim",
    "at_least",
    "at_most",
    "blind",
    "format_claims",
    "last_second",
    "normal_stiffness",
    "phase_reached",
    "within",
]

HOLDS, FAILS, NOT_REACHED, REPORTED = "holds", "FAILS", "not reached", "reported"


@dataclass(frozen=True)
class Claim:
    """One claim about a run.

    Attributes:
        claim: in words.
        value: the number from the log, None if the run ended before it could be taken.
        bound: the limit of the number, in words; None if the number is only reported.
        unit: of the number; empty for a ratio.
        holds: whether it keeps the bound; None if there is no bound or no number.
        blind: whether no plant could break it, since it compares what the controller measures with
            what the controller computes from that.
    """

    claim: str
    value: float | None
    bound: str | None
    unit: str
    holds: bool | None
    blind: bool = False

    def as_dict(self) -> dict[str, object]:
        """Returns the claim for metrics.json."""
        return asdict(self)

    @property
    def verdict(self) -> str:
        """Whether it holds, in words."""
        if self.value is None:
            return NOT_REACHED
        return REPORTED if self.bound is None else HOLDS if self.holds else FAILS

    @property
    def value_text(self) -> str:
        """The value with its unit."""
        return "–" if self.value is None else f"{self.value:.4g} {self.unit}".strip()

    @property
    def bound_text(self) -> str:
        """The bound with the unit."""
        return "–" if self.bound is None else f"{self.bound} {self.unit}".strip()


def at_most(claim: str, value: float | None, bound: float, unit: str = "") -> Claim:
    """Returns the claim that a value does not exceed a bound; infinity means no bound."""
    text = f"≤ {bound:g}" if np.isfinite(bound) else None
    return _claim(claim, value, text, unit, value is not None and value <= bound)


def at_least(claim: str, value: float | None, bound: float, unit: str = "") -> Claim:
    """Returns the claim that a value reaches a bound; minus infinity means no bound."""
    text = f"≥ {bound:g}" if np.isfinite(bound) else None
    return _claim(claim, value, text, unit, value is not None and value >= bound)


def within(
    claim: str, value: float | None, target: float, tolerance: float, unit: str = ""
) -> Claim:
    """Returns the claim that a value differs from a target by no more than a fraction of it."""
    holds = value is not None and abs(value - target) <= tolerance * abs(target)
    return _claim(claim, value, f"{target:g} ± {100 * tolerance:g} %", unit, holds)


def blind(claim: Claim) -> Claim:
    """Returns the claim as one that no plant could break."""
    return replace(claim, blind=True)


def _claim(claim: str, value: float | None, bound: str | None, unit: str, holds: bool) -> Claim:
    number = None if value is None else float(value)
    judged = number is not None and bound is not None
    return Claim(claim, number, bound, unit, bool(holds) if judged else None)


def phase_reached(log: Mapping[str, Array], end: float) -> bool:
    """Returns whether the log reaches a time, to half a sample."""
    t = log["t"]
    return bool(len(t) > 1 and t[-1] >= end - 0.5 * (t[1] - t[0]))


def last_second(log: Mapping[str, Array]) -> Array:
    """Returns the mask of the samples of the last second."""
    return log["t"] >= log["t"][-1] - 1.0


def normal_stiffness(log: Mapping[str, Array], arm: str, samples: Array) -> float:
    """Returns the mean normal force over the depth of D behind the undeformed surface [N/m]."""
    n, offset = log["surface/plane"][:3], log["surface/plane"][3]
    depth = offset - log[f"{arm}/motion_D"][samples][:, POSITION] @ n
    force = -(log[f"{arm}/wrench"][samples, 3:] @ n)
    return float((force / depth).mean())


def format_claims(claims: list[Claim]) -> str:
    """Returns the claims as a table for a terminal."""
    rows = [("claim", "value", "bound", "")] + [
        (claim.claim, claim.value_text, claim.bound_text, claim.verdict) for claim in claims
    ]
    widths = [max(len(row[i]) for row in rows) for i in range(4)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )
