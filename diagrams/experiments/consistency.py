"""Case studies 3 and 4: is the displacement about the axis of the moment? Figs 5.6 to 5.9."""

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.diagrams.experiments.measures import (
    Log,
    end_reached,
    misalignment,
    quaternion_error,
)
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.rotations.quaternion import to_rotation
from geoimp_drake.simulation.claims import Claim, at_least, at_most, last_second, within
from geoimp_drake.simulation.figures import panels_figure
from geoimp_drake.systems.frame_motion import QUATERNION
from geoimp_drake.systems.sources.desired_motion import phases_of
from geoimp_drake.systems.sources.external_wrench import WrenchRamp
from geoimp_drake.typing import Array

__all__ = [
    "consistency_claims",
    "consistency_figures",
    "largest_misalignment",
    "misalignment_at",
    "nondiagonal_claims",
    "nondiagonal_figures",
]

# sin(ϑ/2) where 2.5 sin ϑ = 1.5, the moment of the quaternion spring along its third axis.
SETTLED = np.sin(0.5 * np.arcsin(1.5 / 2.5))


def consistency_claims(log: Log, scenario: SingleArmScenario) -> list[Claim]:
    """Returns the claims of the third case study for the family that was run."""
    if scenario.impedance.orientation == "classical-euler":
        return _misaligned(log, scenario, 0.1)
    return _aligned(log, scenario)


def nondiagonal_claims(log: Log, scenario: SingleArmScenario) -> list[Claim]:
    """Returns the claims of the fourth case study for the family that was run."""
    family = scenario.impedance.orientation
    if family == "alternative-euler":
        return _misaligned(log, scenario, 0.08)
    if family == "classical-euler":  # ruled out by the chapter after the third case study
        return []
    claims = _aligned(log, scenario)
    if family in ("quaternion", "angle-axis-sin-half"):
        epsilon = np.linalg.norm(quaternion_error(log, scenario.arm, "E"), axis=1)
        settled = epsilon[last_second(log)].mean() if end_reached(log, scenario.segments) else None
        claims.append(within("‖ᵉε_de‖ settles at sin(ϑ/2)", settled, SETTLED, 0.01 / SETTLED))
    return claims


def consistency_figures(log: Log, scenario: SingleArmScenario) -> dict[str, Figure]:
    """Returns Fig 5.6, or Fig 5.7 for classical Euler angles."""
    classical = scenario.impedance.orientation == "classical-euler"
    return {"figure_5_7" if classical else "figure_5_6": _figure(log, scenario)}


def nondiagonal_figures(log: Log, scenario: SingleArmScenario) -> dict[str, Figure]:
    """Returns Fig 5.8, or Fig 5.9 for alternative Euler angles."""
    alternative = scenario.impedance.orientation == "alternative-euler"
    return {"figure_5_9" if alternative else "figure_5_8": _figure(log, scenario)}


def largest_misalignment(log: Log, scenario: SingleArmScenario, frame: str) -> float:
    """Returns the largest δ over time about the axis of the applied moment, at C or E."""
    return float(misalignment_at(log, scenario, frame).max())


def misalignment_at(log: Log, scenario: SingleArmScenario, frame: str) -> Array:
    """Returns δ over time (N) about the axis of the applied moment, at C or E."""
    return misalignment(quaternion_error(log, scenario.arm, frame), _axis(log, scenario))


def _axis(log: Log, scenario: SingleArmScenario) -> Array:
    """Returns the applied moment in D; without a moment there is no axis, and any axis will do."""
    ramp = scenario.external or WrenchRamp(moment=np.array([0.0, 0.0, 1.0]), axes="frame")
    if ramp.axes == "frame":
        return ramp.moment
    R_WD = to_rotation(log[f"{scenario.arm}/motion_D"][0, QUATERNION])
    return R_WD.T @ ramp.moment


def _aligned(log: Log, scenario: SingleArmScenario) -> list[Claim]:
    return [
        at_most("largest misalignment δ at E", largest_misalignment(log, scenario, "E"), 2e-3),
        at_most("largest misalignment δ at C", largest_misalignment(log, scenario, "C"), 1e-3),
    ]


def _misaligned(log: Log, scenario: SingleArmScenario, bound: float) -> list[Claim]:
    delta = (
        largest_misalignment(log, scenario, "E") if end_reached(log, scenario.segments) else None
    )
    return [at_least("largest misalignment δ at E", delta, bound)]


def _figure(log: Log, scenario: SingleArmScenario) -> Figure:
    family = scenario.impedance.orientation
    return panels_figure(
        log,
        scenario.arm,
        [
            ("orientation error", "ᵉε_de [-]", quaternion_error(log, scenario.arm, "E"), 0.0),
            ("orientation misalignment", "δ [-]", misalignment_at(log, scenario, "E"), 0.05),
        ],
        f"{scenario.experiment}: {family}",
        phases_of(scenario.segments),
    )
