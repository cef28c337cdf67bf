"""What an experiment claims: a value from the log, its bound, and whether it holds."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np

from geoimp_drake.systems.frame_motion import POSITION
from geoimp_drake.typing import Array

__all__ = [
    "Claim",
    "at_least",
    "at_most",
    "force_spring_error",
    "format_claims",
    "last_second",
    "normal_stiffness",
    "phase_reached",
    "within",
]


@dataclass(frozen=True)
class Claim:
    """One claim about a run.

    Attributes:
        claim: what is claimed, in words.
        value: the number from the log, None if the run ended before it could be taken.
        bound: what the number is held against.
        unit: of the number; empty for a ratio.
        holds: whether it keeps the bound, None if the number could not be taken.
    """

    claim: str
    value: float | None
    bound: str
    unit: str
    holds: bool | None

    def as_dict(self) -> dict[str, object]:
        """Returns the claim for metrics.json."""
        return asdict(self)


def at_most(claim: str, value: float | None, bound: float, unit: str = "") -> Claim:
    """Returns the claim that a value does not exceed a bound."""
    return _claim(claim, value, f"≤ {bound:g}", unit, value is not None and value <= bound)


def at_least(claim: str, value: float | None, bound: float, unit: str = "") -> Claim:
    """Returns the claim that a value reaches a bound."""
    return _claim(claim, value, f"≥ {bound:g}", unit, value is not None and value >= bound)


def within(
    claim: str, value: float | None, target: float, tolerance: float, unit: str = ""
) -> Claim:
    """Returns the claim that a value differs from a target by no more than a fraction of it."""
    holds = value is not None and abs(value - target) <= tolerance * abs(target)
    return _claim(claim, value, f"{target:g} ± {100 * tolerance:g} %", unit, holds)


def _claim(claim: str, value: float | None, bound: str, unit: str, holds: bool) -> Claim:
    if value is None:
        return Claim(claim, None, bound, unit, None)
    return Claim(claim, float(value), bound, unit, bool(holds))


def phase_reached(log: Mapping[str, Array], end: float) -> bool:
    """Returns whether the log reaches a time, to half a sample."""
    t = log["t"]
    return bool(len(t) > 1 and t[-1] >= end - 0.5 * (t[1] - t[0]))


def last_second(log: Mapping[str, Array]) -> Array:
    """Returns the mask of the samples of the last second."""
    return log["t"] >= log["t"][-1] - 1.0


def force_spring_error(log: Mapping[str, Array], arm: str, K_p: Array, samples: Array) -> float:
    """Returns the largest ‖f − K_pΔp_dc‖ / ‖f‖ over some samples: (3.1) at rest."""
    force = log[f"{arm}/wrench"][samples, 3:]
    displacement = (log[f"{arm}/motion_D"] - log[f"{arm}/motion_C"])[samples][:, POSITION]
    error = np.linalg.norm(force - displacement @ K_p.T, axis=1)
    return float((error / np.linalg.norm(force, axis=1)).max())


def normal_stiffness(log: Mapping[str, Array], arm: str, samples: Array) -> float:
    """Returns the mean normal force over the depth of D behind the undeformed surface [N/m]."""
    n, offset = log["surface/plane"][:3], log["surface/plane"][3]
    depth = offset - log[f"{arm}/motion_D"][samples][:, POSITION] @ n
    force = -(log[f"{arm}/wrench"][samples, 3:] @ n)
    return float((force / depth).mean())


def format_claims(claims: list[Claim]) -> str:
    """Returns the claims as a table for a terminal."""
    verdict = {True: "holds", False: "FAILS", None: "not reached"}
    rows = [("claim", "value", "bound", "")] + [
        (
            claim.claim,
            "–" if claim.value is None else f"{claim.value:.4g} {claim.unit}".strip(),
            f"{claim.bound} {claim.unit}".strip(),
            verdict[claim.holds],
        )
        for claim in claims
    ]
    widths = [max(len(row[i]) for row in rows) for i in range(4)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )
