"""How runs of one experiment with different settings are compared, and claims across them."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from geoimp_drake.diagrams.experiments import collision, disturbance, limits
from geoimp_drake.diagrams.experiments.bar import internal_wrench
from geoimp_drake.diagrams.experiments.comparisons import Comparison
from geoimp_drake.diagrams.experiments.measures import Log, ended_in_contact
from geoimp_drake.diagrams.experiments.redundancy import task_value
from geoimp_drake.simulation.claims import Claim, at_least, at_most, last_second
from geoimp_drake.systems.sources.desired_motion import phases_of
from geoimp_drake.typing import Array

__all__ = ["CONTRASTS"]

Runs = Mapping[str, tuple[Log, Any]]
Curve = tuple[str, str, Array]

FORCE, MOMENT = slice(3, 6), slice(0, 3)


def _null_space_curves(log: Log, scenario: Any) -> list[Curve]:
    force = log[f"{scenario.arm}/wrench"][:, FORCE]
    return [
        ("contact force", "‖f‖ [N]", _norm(force)),
        ("task function", "w [rad²]", task_value(log, scenario)),
    ]


def _null_space_claims(runs: Runs) -> list[Claim]:
    """Returns the claims that null-space motion makes w fall and does not disturb the contact."""
    if not {"with-k-beta", "without-k-beta"} <= runs.keys():
        return []
    (log, scenario), (other, unaware) = runs["with-k-beta"], runs["without-k-beta"]
    reached = all(ended_in_contact(one, own.segments) for one, own in runs.values())
    values = _null_space_values(log, scenario, other, unaware) if reached else {}
    value = values.get
    return [
        at_most("contact force without k_β off that with it, over the peak", value("force"), 0.03),
        at_most(
            "contact moment without k_β off that with it, over the peak", value("moment"), 0.03
        ),
        at_most("w at the end of contact, with k_β over without", value("w"), 0.02),
    ]


def _null_space_values(log: Log, scenario: Any, other: Log, unaware: Any) -> dict[str, float]:
    bounds = {name: (begin, end) for name, begin, end in phases_of(scenario.segments)}
    begin, end = bounds["approach"][0], bounds["contact"][1]
    contact = (log["t"] >= begin) & (log["t"] <= end)
    wrench, without = (one[f"{scenario.arm}/wrench_true"][contact] for one in (log, other))
    difference = np.abs(wrench - without)
    last = np.flatnonzero(contact)[-1]
    return {
        "force": float(difference[:, FORCE].max() / np.abs(wrench[:, FORCE]).max()),
        "moment": float(difference[:, MOMENT].max() / np.abs(wrench[:, MOMENT]).max()),
        "w": float(task_value(log, scenario)[last] / task_value(other, unaware)[last]),
    }


def _mating_curves(log: Log, scenario: Any) -> list[Curve]:
    wrench = log[f"{scenario.compliant}/wrench_true"]
    return [
        ("true mating force", "‖f‖ [N]", _norm(wrench[:, FORCE])),
        ("true mating moment", "‖μ‖ [Nm]", _norm(wrench[:, MOMENT])),
    ]


def _mating_claims(runs: Runs) -> list[Claim]:
    """Returns the claim on the larger load of a stiff hand with the same plan."""
    if not {"misplanned", "position-controlled"} <= runs.keys():
        return []
    compliant, rigid = runs["misplanned"], runs["position-controlled"]
    # The load of a rigid hand may end the simulation: the peak counts nevertheless.
    inserted = float(compliant[0]["t"][-1]) >= float(compliant[0]["program/times"][-1, 1])
    ratio = _peak_force(*rigid) / _peak_force(*compliant) if inserted else None
    return [
        at_least("peak force of the mis-planned run, position-controlled over compliant", ratio, 3)
    ]


def _peak_force(log: Log, scenario: Any) -> float:
    return float(_norm(log[f"{scenario.compliant}/wrench_true"][:, FORCE]).max())


def _squeeze_curves(log: Log, scenario: Any) -> list[Curve]:
    return [
        ("internal force", "½‖f_2 − f_1‖ [N]", _norm(internal_wrench(log)[:, FORCE])),
        ("contact force", "‖f‖ [N]", _norm(log["object/wrench"][:, FORCE])),
    ]


def _squeeze_claims(runs: Runs) -> list[Claim]:
    """Returns the claims that the internal impedance removes a squeeze and keeps the contact."""
    if not {"squeezed", "squeezed-rigid-hands"} <= runs.keys():
        return []
    pair = [runs["squeezed"], runs["squeezed-rigid-hands"]]
    reached = all(ended_in_contact(log, scenario.segments) for log, scenario in pair)
    (squeeze, force), (kept, other) = (_steady_forces(log) for log, _ in pair)
    return [
        at_most(
            "steady internal force, with the internal impedance over without",
            squeeze / kept if reached else None,
            1 / 3,
        ),
        at_most(
            "steady contact force, with the internal impedance off that without",
            abs(force / other - 1.0) if reached else None,
            0.03,
        ),
    ]


def _steady_forces(log: Log) -> tuple[float, float]:
    """Returns the means over the last second of internal force and of the force on the surface."""
    rest = last_second(log)
    internal, force = internal_wrench(log)[rest, FORCE], log["object/wrench"][rest, FORCE]
    return float(_norm(internal).mean()), float(_norm(force).mean())


def _norm(vectors: Array) -> Array:
    return np.linalg.norm(vectors, axis=1)


CONTRASTS = {
    "redundancy": Comparison(_null_space_curves, _null_space_claims),
    "peg_in_hole": Comparison(_mating_curves, _mating_claims),
    "bar": Comparison(_squeeze_curves, _squeeze_claims),
    "disturbance": Comparison(
        None,
        disturbance.claims_across,
        disturbance.figure_across,
        disturbance.tables_across,
    ),
    "limits": Comparison(None, limits.claims_across, limits.figure_across),
    "collision": Comparison(None, collision.claims_across, collision.figure_across),
}
