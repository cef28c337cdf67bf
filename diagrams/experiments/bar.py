"""Tight cooperation: the claims of `bar`, and Fig 5.13."""

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.diagrams.experiments.measures import (
    ORIENTATION_LABELS,
    Log,
    drift,
    ended_in_contact,
    orientation_displacement,
    quaternion_error,
    spring_claims,
    spring_errors,
    true_wrench,
)
from geoimp_drake.diagrams.setups.tight_scenario import ARMS, OBJECT, TightScenario
from geoimp_drake.rotations import quaternion
from geoimp_drake.simulation.claims import (
    Claim,
    at_least,
    at_most,
    last_second,
    within,
)
from geoimp_drake.simulation.figures import interaction_figure
from geoimp_drake.systems.frame_motion import LINEAR_VELOCITY, POSITION, QUATERNION
from geoimp_drake.systems.sources.desired_motion import phases_of
from geoimp_drake.typing import Array

__all__ = ["claims", "contact_stiffness", "figures", "internal_wrench", "sweep_values"]

# 1300 N/m of the impedance and 5000 N/m of the box in series.
NORMAL_STIFFNESS = 1300.0 * 5000.0 / (1300.0 + 5000.0)
STEADY_SQUEEZE, RINGING = 12.0, 3.0  # of the internal force [N]
DETECTION = 0.02  # [s]
AFTER_STOP = 0.05  # after the hold, when the hands have to be at rest [s]


def claims(log: Log, scenario: TightScenario) -> list[Claim]:
    """Returns the claims, each with its value from the log."""
    if scenario.release is not None:
        return _claims_on_release(log, scenario)
    internal = internal_wrench(log)
    return [
        *_claims_at_rest(log, scenario),
        *_claims_on_following(log),
        at_most("largest internal force", _norm(internal[:, 3:]).max(), 30.0, "N"),
    ]


def sweep_values(log: Log, scenario: TightScenario) -> dict[str, float | bool]:
    """Returns the values for a sweep's table: success is a bounded squeeze that comes to rest."""
    force = _norm(internal_wrench(log)[:, 3:])
    settled = force[log["t"] >= log["t"][-1] - 0.5]
    steady, ringing = float(settled.mean()), float(np.ptp(settled))
    return {
        "success": bool(steady <= STEADY_SQUEEZE and ringing <= RINGING),
        "steady_squeeze": steady,
        "ringing": ringing,
        "largest_squeeze": float(force.max()),
    }


def internal_wrench(log: Log) -> Array:
    """Returns ½(h_2 − h_1) of the true wrenches over time (N×6): the sensors may clip theirs."""
    first, second = (log[f"{arm}/wrench_true"] for arm in ARMS)
    return 0.5 * (second - first)


def contact_stiffness(log: Log, samples: Array) -> float:
    """Returns the mean normal force divided by the depth of p_d + R_c s behind the surface [N/m].

    s is the disk's centre in O: this takes the rotation of the object out of the depth.
    """
    n, offset = log["surface/plane"][:3], log["surface/plane"][3]
    D, C = (log[f"{OBJECT}/motion_{frame}"][samples] for frame in "DC")
    R_WC = [quaternion.to_rotation(Q_WC) for Q_WC in C[:, QUATERNION]]
    disk = D[:, POSITION] + np.array([R @ log["surface/disk"] for R in R_WC])
    force = -(log[f"{OBJECT}/wrench"][samples, 3:] @ n)
    return float((force / (offset - disk @ n)).mean())


def _claims_at_rest(log: Log, scenario: TightScenario) -> list[Claim]:
    """Returns the claims on the steady state, without values where the run ended before it."""
    values = _values_at_rest(log, scenario) if ended_in_contact(log, scenario.segments) else {}
    value = values.get
    return [
        at_least("Δp_dc along Z_d", value("along"), 20.0, "mm"),
        at_most("Δp_dc along Y_d", value("sideways"), 2.0, "mm"),
        at_least("ᶜε_dc about Y_d over that about the other axes", value("axis"), 3.0),
        at_most("force along X_d over that along Z_d", value("across"), 0.5),
        at_most("drift of the force in the last second", value("drift"), 0.1, "N"),
        at_most("drift of the moment in the last second", value("moment drift"), 0.05, "Nm"),
        *spring_claims(values, {"force": 0.02, "moment": 0.02}),
        within("normal force over depth", value("stiffness"), NORMAL_STIFFNESS, 0.1, "N/m"),
    ]


def _values_at_rest(log: Log, scenario: TightScenario) -> dict[str, float]:
    rest = last_second(log)
    dp = (log[f"{OBJECT}/motion_D"] - log[f"{OBJECT}/motion_C"])[rest][:, POSITION]
    dp = np.abs(dp.mean(axis=0))
    epsilon = np.abs(quaternion_error(log, OBJECT, "C")[rest].mean(axis=0))
    true = true_wrench(log, OBJECT)[rest]
    force = np.abs(true[:, 3:].mean(axis=0))
    return {
        "along": 1e3 * float(dp[2]),
        "sideways": 1e3 * float(dp[1]),
        "axis": float(epsilon[1] / epsilon[[0, 2]].max()),
        "across": float(force[0] / force[2]),
        "drift": drift(true[:, 3:]),
        "moment drift": drift(true[:, :3]),
        **spring_errors(log, OBJECT, scenario.impedance, rest),
        "stiffness": contact_stiffness(log, rest),
    }


def _claims_on_following(log: Log) -> list[Claim]:
    """Returns the claims that both hands are at their references."""
    lag = max(float(_lag(log, arm).max()) for arm in ARMS)
    turn = max(float(_norm(_attitude_error(log, arm)).max()) for arm in ARMS)
    return [
        at_most("largest distance of a hand from its reference", 1e3 * lag, 0.5, "mm"),
        at_most("largest ‖ε‖ of a hand from its reference", turn, 2e-3),
    ]


def _lag(log: Log, arm: str) -> Array:
    """Returns the distance of a hand from its reference over time (N) [m]."""
    return _norm((log[f"{arm}/motion_r"] - log[f"{arm}/motion_E"])[:, POSITION])


def _attitude_error(log: Log, arm: str) -> Array:
    """Returns ε of a hand's reference seen from the hand over time (N×3)."""
    E, r = (log[f"{arm}/motion_{frame}"][:, QUATERNION] for frame in "Er")
    return np.array([quaternion.relative(Q_WE, Q_Wr)[1:] for Q_WE, Q_Wr in zip(E, r, strict=True)])


def _claims_on_release(log: Log, scenario: TightScenario) -> list[Claim]:
    """Returns the claims about a grasp that opens: it is detected at once, and both hands stay."""
    values = _values_on_release(log, scenario)
    value = values.get
    return [
        at_most("time until the open grasp is seen", value("detection"), 1e3 * DETECTION, "ms"),
        at_most("fastest hand from 50 ms after the hold on", value("speed"), 0.05, "m/s"),
        at_most("largest lag of the hand that holds the bar", value("lag"), 12.0, "mm"),
    ]


def _values_on_release(log: Log, scenario: TightScenario) -> dict[str, float]:
    """Returns the values after the grasp has opened; none if that was not detected."""
    t, release = log["t"], scenario.release
    seen = float(log["grasp/opened"][-1, 2]) if "grasp/opened" in log else -1.0
    if release is None or seen < 0.0:
        return {}
    late = t >= seen + AFTER_STOP
    speeds = [_norm(log[f"{arm}/motion_E"][late][:, LINEAR_VELOCITY]).max() for arm in ARMS]
    return {
        "detection": 1e3 * (seen - release),
        "speed": float(max(speeds)),
        "lag": 1e3 * float(_lag(log, scenario.carrier)[t >= release].max()),
    }


def _norm(vectors: Array) -> Array:
    return np.linalg.norm(vectors, axis=1)


def figures(log: Log, scenario: TightScenario) -> dict[str, Figure]:
    """Returns Fig 5.13 with the internal wrench below."""
    family, internal = scenario.impedance.orientation, log[f"{OBJECT}/wrench_internal"]
    return {
        "figure_5_13": interaction_figure(
            {**log, f"{OBJECT}/wrench_true": log[f"{OBJECT}/wrench"]},
            OBJECT,
            orientation_displacement(log, OBJECT, scenario.impedance),
            title=f"bar: impedance of the object, {family}",
            orientation_label=ORIENTATION_LABELS[family],
            phases=phases_of(scenario.segments),
            further=(
                ("internal force", internal[:, 3:], "½(f_2 − f_1) [N]"),
                ("internal moment", internal[:, :3], "½(μ_2 − μ_1) [Nm]"),
            ),
        )
    }
