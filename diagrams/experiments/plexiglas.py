"""Case study 1: the claims of `plexiglas`, and Fig 5.3."""

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.diagrams.experiments.measures import (
    ORIENTATION_LABELS,
    Log,
    drift,
    ended_in_contact,
    orientation_displacement,
    spring_claims,
    spring_errors,
    true_wrench,
)
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.simulation.claims import (
    Claim,
    at_least,
    at_most,
    last_second,
    normal_stiffness,
    within,
)
from geoimp_drake.simulation.figures import interaction_figure
from geoimp_drake.systems.frame_motion import POSITION
from geoimp_drake.systems.sources.desired_motion import phases_of
from geoimp_drake.typing import Array

__all__ = ["claims", "figures"]

# 700 N/m of the impedance and 10⁴ N/m of the surface in series.
NORMAL_STIFFNESS = 700.0 * 1e4 / (700.0 + 1e4)


def claims(log: Log, scenario: SingleArmScenario) -> list[Claim]:
    """Returns the claims of the first case study, each with its value from the log."""
    wrench = np.abs(log[f"{scenario.arm}/wrench_true"])
    return [
        *_claims_at_rest(log, scenario),
        at_most("largest force component", wrench[:, 3:].max(), 130.0, "N"),
        at_most("largest moment component", wrench[:, :3].max(), 10.0, "Nm"),
    ]


def _claims_at_rest(log: Log, scenario: SingleArmScenario) -> list[Claim]:
    """Returns the claims on the steady state, without values where the run ended before it."""
    values = _values_at_rest(log, scenario) if ended_in_contact(log, scenario.segments) else {}
    value = values.get
    return [
        *spring_claims(values, {"force": 0.01, "moment": 0.02}),
        within("normal force over depth", value("stiffness"), NORMAL_STIFFNESS, 0.1, "N/m"),
        at_most("drift of the force in the last second", value("drift"), 0.1, "N"),
        at_most("Δp_dc along X, Y over that along Z", value("sideways"), 0.1),
        at_least("smaller component of ᶜε_dc in the disk's plane", value("tilt"), 0.01),
        at_most("moment about Z", value("twist"), 0.05, "Nm"),
    ]


def _values_at_rest(log: Log, scenario: SingleArmScenario) -> dict[str, float]:
    arm, rest = scenario.arm, last_second(log)
    tilt = orientation_displacement(log, arm, scenario.impedance)[rest].mean(axis=0)
    return {
        **spring_errors(log, arm, scenario.impedance, rest),
        "stiffness": normal_stiffness(log, arm, rest),
        "drift": drift(true_wrench(log, arm)[rest, 3:]),
        "sideways": _sideways(log, arm, rest),
        "tilt": float(np.abs(tilt[:2]).min()),
        "twist": float(np.abs(log[f"{arm}/wrench"][rest, 2].mean())),
    }


def _sideways(log: Log, arm: str, samples: Array) -> float:
    """Returns the larger |Δp_dc| along X and Y divided by that along Z, of the mean."""
    dp = (log[f"{arm}/motion_D"] - log[f"{arm}/motion_C"])[samples][:, POSITION].mean(axis=0)
    return float(np.abs(dp[:2]).max() / np.abs(dp[2]))


def figures(log: Log, scenario: SingleArmScenario) -> dict[str, Figure]:
    """Returns Fig 5.3."""
    family = scenario.impedance.orientation
    return {
        "figure_5_3": interaction_figure(
            log,
            scenario.arm,
            orientation_displacement(log, scenario.arm, scenario.impedance),
            title=f"plexiglas: six-DOF impedance control, {family}",
            orientation_label=ORIENTATION_LABELS[family],
            phases=phases_of(scenario.segments),
        )
    }
