"""Loose cooperation: the claims of `peg_in_hole`, and Fig 5.12."""

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.analysis.encounter import Encounter
from geoimp_drake.diagrams.experiments.measures import Log, spring_force
from geoimp_drake.diagrams.scene.insertion import insertion
from geoimp_drake.diagrams.setups.loose_scenario import LooseScenario
from geoimp_drake.simulation.claims import Claim, at_least, at_most, blind, last_second, within
from geoimp_drake.simulation.figures import panels_figure
from geoimp_drake.systems.frame_motion import pose_of
from geoimp_drake.typing import Array

__all__ = ["claims", "depth", "encounter", "figures", "sweep_values"]

FORCE_BOUND, MOMENT_BOUND = 50.0, 5.0  # within which mating stays [N, Nm]
FORCE_RANGE, MOMENT_RANGE = 130.0, 10.0  # of the wrist sensor
IN_THE_HOLE = 2e-3  # depth of a tip, deeper than a tilt can put its edge [m]
STEADY_FORCE = 25.0, 0.4  # 15 to 35 N


def depth(log: Log, scenario: LooseScenario) -> Array:
    """Returns the depth of the peg's tip behind the hole's mouth over time (N) [m]."""
    tip, mouth = log[f"{scenario.peg_arm}/motion_E"], log["hole/motion_H"]
    return np.array(
        [insertion(pose_of(P), pose_of(H)).depth for P, H in zip(tip, mouth, strict=True)]
    )


def encounter(log: Log, scenario: LooseScenario, step: float) -> Encounter:
    """Returns how the hole's bottom, where D would have it, meets the peg's tip."""
    X_WH = pose_of(log["hole/motion_H"][0])
    tip = log[f"{scenario.peg_arm}/motion_E"]
    depths = np.array([insertion(pose_of(X_WP), X_WH).depth for X_WP in tip])
    behind = depths - scenario.peg_hole.hole_depth
    return Encounter.of_depths(log["t"], behind, step, X_WH.rotation().col(2))


def claims(log: Log, scenario: LooseScenario) -> list[Claim]:
    """Returns the claims, each with its value from the log."""
    if scenario.impedance.axes == "none":
        return [_beyond_the_sensor(log, scenario)]
    force, moment = _peaks(log, scenario)
    return [
        *_claims_at_rest(log, scenario),
        at_most("largest mating force component", force, FORCE_BOUND, "N"),
        at_most("largest mating moment component", moment, MOMENT_BOUND, "Nm"),
    ]


def sweep_values(log: Log, scenario: LooseScenario) -> dict[str, float | bool]:
    """Returns the values for a sweep's table: success is a seated peg with small forces.

    A peg that is not seated has jammed if its tip is in the hole; otherwise it has missed it.
    """
    final = float(depth(log, scenario)[-1])
    force, moment = _peaks(log, scenario)
    seated = _is_seated(log, scenario, final)
    return {
        "success": bool(seated and force <= FORCE_BOUND and moment <= MOMENT_BOUND),
        "seated": bool(seated),
        "jammed": bool(not seated and final >= IN_THE_HOLE),
        "time": float(log["t"][-1]),
        "final_depth": final,
        "mating_force": force,
        "mating_moment": moment,
    }


def _beyond_the_sensor(log: Log, scenario: LooseScenario) -> Claim:
    """Returns the claim on the same run without impedance: it would break something."""
    force, moment = _peaks(log, scenario)
    excess = max(force / FORCE_RANGE, moment / MOMENT_RANGE)
    return at_least(
        "without impedance: largest force or moment over the sensor's range",
        excess if excess >= 1.0 or _reached(log, scenario) else None,
        1.0,
    )


def _claims_at_rest(log: Log, scenario: LooseScenario) -> list[Claim]:
    """Returns the claims on the steady state, without values where the run ended before it."""
    values = _values_at_rest(log, scenario) if _reached(log, scenario) else {}
    value = values.get
    seated = [at_least("depth of the peg", value("depth"), 1e3 * _least_depth(scenario), "mm")]
    if _overshoot(scenario) <= 0:
        return seated
    return [
        *seated,
        within("steady axial force", value("force"), *STEADY_FORCE, "N"),
        blind(at_most("K_p,y Δp_y against it, relative error", value("spring"), 0.03)),
        at_most("the same of the true force and E, relative error", value("true spring"), 0.03),
    ]


def _values_at_rest(log: Log, scenario: LooseScenario) -> dict[str, float]:
    arm, rest = scenario.compliant, last_second(log)
    X_WH = pose_of(log["hole/motion_H"][0])
    axis = X_WH.rotation().col(2).copy()  # Drake's is a view of the pose
    force, true_force = (
        (log[f"{arm}/{key}"][rest, 3:] @ axis).mean() for key in ("wrench", "wrench_true")
    )
    spring, true_spring = (
        (spring_force(log, arm, scenario.impedance, rest, true=true) @ axis).mean()
        for true in (False, True)
    )
    return {
        "depth": 1e3 * float(depth(log, scenario)[rest].min()),
        "force": float(abs(force)),
        "spring": float(abs(spring / force - 1.0)),
        "true spring": float(abs(true_spring / true_force - 1.0)),
    }


def _is_seated(log: Log, scenario: LooseScenario, final: float) -> bool:
    if scenario.until is not None:
        return final >= scenario.until.depth
    return _reached(log, scenario) and final >= _least_depth(scenario)


def _least_depth(scenario: LooseScenario) -> float:
    """Returns the depth at which the peg counts as seated [m]."""
    bottom = scenario.peg_hole.hole_depth
    return min(scenario.planned().path - 0.005, bottom - 0.0005)


def _overshoot(scenario: LooseScenario) -> float:
    """Returns the distance by which the plan leads past the hole's bottom [m]."""
    return scenario.planned().path - scenario.peg_hole.hole_depth


def _peaks(log: Log, scenario: LooseScenario) -> tuple[float, float]:
    """Returns the largest true force and moment component at E."""
    wrench = np.abs(log[f"{scenario.compliant}/wrench_true"])
    return float(wrench[:, 3:].max()), float(wrench[:, :3].max())


def _reached(log: Log, scenario: LooseScenario) -> bool:
    """Returns whether the peg's arm has come to rest: its last second has one set-point."""
    set_point = log[f"{scenario.peg_arm}/set_point"][last_second(log)]
    moving = set_point[:, set_point.shape[1] // 2 :]
    return bool(log["t"][-1] > 1.0 and not moving.any())


def figures(log: Log, scenario: LooseScenario) -> dict[str, Figure]:
    """Returns Fig 5.12 with the depth beside it, from the beginning of the insertion."""
    moves = [
        (str(name), float(begin), float(end))
        for name, (begin, end) in zip(log["program/moves"], log["program/times"], strict=True)
    ]
    begin = min(moves[-1][1], float(log["t"][-1]))
    late = log["t"] >= begin
    wrench = log[f"{scenario.compliant}/wrench"][late]
    behind = 1e3 * depth(log, scenario)[late]
    return {
        "figure_5_12": panels_figure(
            {"t": log["t"][late]},
            scenario.compliant,
            [
                ("mating force", "f [N]", wrench[:, 3:], 1.0),
                ("mating moment", "μ [Nm]", wrench[:, :3], 0.1),
                (
                    "depth of the peg's tip",
                    "depth [mm]",
                    behind,
                    1e3 * scenario.peg_hole.hole_depth,
                ),
            ],
            f"peg_in_hole, {scenario.plan} plan",
            [("insertion", begin, moves[-1][2]), ("hold", moves[-1][2], float(log["t"][-1]))],
        )
    }
