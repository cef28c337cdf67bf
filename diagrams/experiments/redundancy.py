"""Case study 5: the claims of `redundancy`, and Figs 5.10 and 5.11."""

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.diagrams.experiments.measures import (
    ORIENTATION_LABELS,
    Log,
    orientation_displacement,
    quaternion_error,
    spring_claims,
    spring_errors,
)
from geoimp_drake.diagrams.scene.cell import joint_names
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.rotations.quaternion import to_rotation
from geoimp_drake.simulation.claims import (
    Claim,
    at_most,
    last_second,
    phase_reached,
)
from geoimp_drake.simulation.figures import interaction_figure, panels_figure
from geoimp_drake.systems.frame_motion import POSITION, QUATERNION
from geoimp_drake.systems.sources.desired_motion import phases_of
from geoimp_drake.typing import Array

__all__ = ["claims", "figures", "task_value"]


def claims(log: Log, scenario: SingleArmScenario) -> list[Claim]:
    """Returns the claims of the fifth case study, each with its value from the log.

    A test compares the run with k_β and the one without.
    """
    return [
        *_claims_on_reconfiguration(log, scenario),
        *_claims_on_contact(log, scenario),
        *_claims_after_leaving(log, scenario),
    ]


def task_value(log: Log, scenario: SingleArmScenario) -> Array:
    """Returns w = ½ Σ (q_i − q_di)² over time (N), q_d the end of the joint target's trajectory."""
    task = scenario.redundancy.task
    if task is None or task.kind != "joint-target":
        return np.zeros(len(log["t"]))
    columns = [joint_names(scenario.arm).index(name) for name in task.joints]
    error = log[f"{scenario.arm}/q"][:, columns] - np.asarray(task.target)
    return 0.5 * (error**2).sum(axis=1)


def _claims_on_reconfiguration(log: Log, scenario: SingleArmScenario) -> list[Claim]:
    arm, end = scenario.arm, _end_of(scenario, "reconfigure")
    during = log["t"] <= end
    error = (log[f"{arm}/motion_D"] - log[f"{arm}/motion_E"])[during, POSITION]
    position = float(np.linalg.norm(error, axis=1).max())
    angle = float(np.linalg.norm(quaternion_error(log, arm, "E")[during], axis=1).max())
    w = float(np.sqrt(2 * task_value(log, scenario)[during][-1]))
    reached = phase_reached(log, end)
    claims = [
        at_most("reconfiguration: largest ‖Δp_de‖", position if reached else None, 1e-3, "m"),
        at_most("reconfiguration: largest ‖ᵉε_de‖", angle if reached else None, 2e-3),
    ]
    if scenario.redundancy.k_beta != 0:
        claims.append(
            at_most("elbow off its target at the end of it", w if reached else None, 0.01, "rad")
        )
    return claims


def _claims_on_contact(log: Log, scenario: SingleArmScenario) -> list[Claim]:
    """Returns the claims on the last second of contact."""
    end = _end_of(scenario, "contact")
    touched = "surface/plane" in log and phase_reached(log, end)
    values = _contact_values(log, scenario, end) if touched else {}
    value = values.get
    claims = [
        *spring_claims(values, {"force": 0.01}),
        at_most("ᶜε_dc about other axes over that about y_C", value("axis"), 0.05),
        at_most("moment about other axes over that about y_C", value("moment"), 0.05),
        at_most("force across the motion over that along it", value("across"), 0.5),
    ]
    if scenario.redundancy.k_beta != 0:
        claims.append(at_most("w at the end of contact over that at the start", value("w"), 0.02))
    return claims


def _contact_values(log: Log, scenario: SingleArmScenario, end: float) -> dict[str, float]:
    arm = scenario.arm
    settled = (log["t"] >= end - 1.0) & (log["t"] <= end)
    epsilon = orientation_displacement(log, arm, scenario.impedance)[settled].mean(axis=0)
    wrench = log[f"{arm}/wrench"][settled].mean(axis=0)
    # D keeps its attitude, so its y axis at the start is the axis about which the disk is tilted.
    y_W = to_rotation(log[f"{arm}/motion_D"][0, QUATERNION])[:, 1]
    w = task_value(log, scenario)
    return {
        **spring_errors(log, arm, scenario.impedance, settled, ["force"]),
        "axis": float(np.abs(epsilon[[0, 2]]).max() / abs(epsilon[1])),
        "moment": _across_over_along(wrench[:3], y_W),
        "across": _across_over_along(wrench[3:], log["surface/plane"][:3]),
        "w": float(w[settled][-1] / w[0]) if w[0] > 0 else 0.0,
    }


def _across_over_along(vector: Array, axis: Array) -> float:
    """Returns the ratio of the parts of a vector (3) across and along a unit axis."""
    along = vector @ axis
    return float(np.linalg.norm(vector - along * axis) / abs(along))


def _claims_after_leaving(log: Log, scenario: SingleArmScenario) -> list[Claim]:
    """Returns the claims that everything is back to zero at the end."""
    arm, rest = scenario.arm, last_second(log)
    end = sum(segment.duration for segment in scenario.segments)
    reached = phase_reached(log, end)
    epsilon = orientation_displacement(log, arm, scenario.impedance)
    offset = (log[f"{arm}/motion_D"] - log[f"{arm}/motion_C"])[:, POSITION]
    values = {
        "force at the end": (np.abs(log[f"{arm}/wrench"][rest, 3:].mean(axis=0)).max(), 0.5, "N"),
        "Δp_dc at the end": (
            np.abs(offset[rest].mean(axis=0)).max(),
            1e-3,
            "m",
        ),
        "ᶜε_dc at the end": (np.abs(epsilon[rest].mean(axis=0)).max(), 0.01, ""),
    }
    return [
        at_most(name, float(value) if reached else None, bound, unit)
        for name, (value, bound, unit) in values.items()
    ]


def figures(log: Log, scenario: SingleArmScenario) -> dict[str, Figure]:
    """Returns Figs 5.10 and 5.11, the phases marked."""
    arm, family = scenario.arm, scenario.impedance.orientation
    phases = phases_of(scenario.segments)
    elbow = log[f"{arm}/q"][:, joint_names(arm).index("elbow")]
    k_beta = scenario.redundancy.k_beta
    return {
        "figure_5_10": interaction_figure(
            log,
            arm,
            orientation_displacement(log, scenario.arm, scenario.impedance),
            title=f"redundancy: six-DOF impedance control, {family}, k_β = {k_beta:g}",
            orientation_label=ORIENTATION_LABELS[family],
            phases=phases,
        ),
        "figure_5_11": panels_figure(
            log,
            arm,
            [
                ("elbow", "q [rad]", elbow, None),
                ("task function", "w [rad²]", task_value(log, scenario), 0.0),
            ],
            f"redundancy: null-space motion, k_β = {k_beta:g}",
            phases,
        ),
    }


def _end_of(scenario: SingleArmScenario, name: str) -> float:
    """Returns the end of a phase [s]; of the whole motion if there is no phase of that name."""
    ends = [end for label, _, end in phases_of(scenario.segments) if label == name]
    return ends[0] if ends else sum(segment.duration for segment in scenario.segments)
