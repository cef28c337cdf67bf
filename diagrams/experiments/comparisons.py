"""Comparisons of families: one curve per family in each panel, and claims across them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from geoimp_drake.diagrams.experiments import orientation_loop
from geoimp_drake.diagrams.experiments.consistency import misalignment_at
from geoimp_drake.diagrams.experiments.measures import (
    Log,
    ended_in_contact,
    quaternion_error,
    true_wrench,
)
from geoimp_drake.diagrams.experiments.singularity import held_and_peak
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.simulation.claims import Claim, at_least, at_most, last_second
from geoimp_drake.typing import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from geoimp_drake.campaigns.table import Table

__all__ = ["CHAPTER_FAMILIES", "COMPARISONS", "Comparison", "Runs"]

CHAPTER_FAMILIES = ("quaternion", "classical-euler", "alternative-euler")

Runs = Mapping[str, tuple[Log, Any]]
Curve = tuple[str, str, Array]


@dataclass(frozen=True)
class Comparison:
    """How the runs of several families are compared.

    Attributes:
        curves: title, label of the axis with its unit, and values (N) of each panel, of one run.
        claims: across families, from log and scenario by family.
        figure: of all runs, instead of `curves`, if it is not over time.
        tables: of all runs.
    """

    curves: Callable[[Log, Any], list[Curve]] | None
    claims: Callable[[Runs], list[Claim]]
    figure: "Callable[[Runs], Figure] | None" = None
    tables: "Callable[[Runs], list[Table]]" = lambda runs: []


def _wrench_curves(log: Log, scenario: Any) -> list[Curve]:
    wrench = log[f"{scenario.compliant}/wrench"]
    return [
        ("contact force", "‖f‖ [N]", np.linalg.norm(wrench[:, 3:], axis=1)),
        ("contact moment", "‖μ‖ [Nm]", np.linalg.norm(wrench[:, :3], axis=1)),
    ]


def _alignment_curves(log: Log, scenario: SingleArmScenario) -> list[Curve]:
    epsilon = quaternion_error(log, scenario.arm, "E")
    return [
        ("orientation error", "‖ᵉε_de‖ [-]", np.linalg.norm(epsilon, axis=1)),
        ("orientation misalignment", "δ [-]", misalignment_at(log, scenario, "E")),
    ]


def _agreement(runs: Runs) -> list[Claim]:
    """Returns the claims that the families give nearly the same contact force."""
    peaks, steady = [], []
    for log, scenario in runs.values():
        force = np.linalg.norm(true_wrench(log, scenario.compliant)[:, 3:], axis=1)
        peaks.append(force.max())
        steady.append(
            force[last_second(log)].mean() if ended_in_contact(log, scenario.segments) else None
        )
    return [
        at_most("spread of the peak force over the families", _spread(peaks), 0.15),
        at_most("spread of the steady force over the families", _spread(steady), 0.15),
    ]


def _spread(values: list[float | None]) -> float | None:
    """Returns the largest divided by the smallest, less one; None if one is missing or zero."""
    known = [value for value in values if value]
    return max(known) / min(known) - 1.0 if len(known) == len(values) else None


def _ratios(runs: Runs) -> list[Claim]:
    """Returns the claims: classical Euler angles load the contact more, alternative ones alike."""
    loads = {
        family: held_and_peak(log, scenario.arm)
        for family, (log, scenario) in runs.items()
        if ended_in_contact(log, scenario.segments)
    }
    if "quaternion" not in loads:
        return []
    base = loads["quaternion"]
    claims = []
    for name, value in loads.get("classical-euler", {}).items():
        bound = 3.0 if name.startswith("held") else 1.7
        claims.append(
            at_least(f"{name}, classical Euler over quaternion", value / base[name], bound)
        )
    for name, value in loads.get("alternative-euler", {}).items():
        difference = abs(value / base[name] - 1.0)
        claims.append(at_most(f"{name}, alternative Euler off quaternion", difference, 0.2))
    return claims


def _none(runs: Runs) -> list[Claim]:
    return []


COMPARISONS = {
    "plexiglas": Comparison(_wrench_curves, _agreement),
    "singularity": Comparison(_wrench_curves, _ratios),
    "consistency": Comparison(_alignment_curves, _none),
    "nondiagonal": Comparison(_alignment_curves, _none),
    "redundancy": Comparison(_wrench_curves, _agreement),
    "peg_in_hole": Comparison(_wrench_curves, _none),
    "bar": Comparison(_wrench_curves, _agreement),
    "disturbance": Comparison(_wrench_curves, _agreement),
    "orientation_loop": Comparison(
        None, orientation_loop.claims_across, orientation_loop.figure_across
    ),
}
