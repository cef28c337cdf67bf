"""Your own experiment: claims on any impedance, and the figure of its errors and wrench."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.diagrams.experiments.measures import (
    ORIENTATION_LABELS,
    Log,
    drift,
    orientation_displacement,
    spring_claims,
    spring_errors,
    true_wrench,
)
from geoimp_drake.simulation.claims import (
    Claim,
    at_most,
    last_second,
    phase_reached,
)
from geoimp_drake.simulation.figures import interaction_figure
from geoimp_drake.systems.frame_motion import VELOCITY
from geoimp_drake.systems.sources.desired_motion import phases_of

__all__ = ["claims", "figures"]

# Below these values a relative error means nothing [N, Nm].
_LEAST_FORCE, _LEAST_MOMENT = 0.5, 0.05


def claims(log: Log, scenario: Any) -> list[Claim]:
    """Returns the claims that the impedance holds at rest, as far as there is a wrench then."""
    at_rest = phase_reached(log, scenario.duration) and log["t"][-1] > 1.0
    values = _values_at_rest(log, scenario) if at_rest else {}
    value = values.get
    speeds = _joint_speeds(log, scenario) if at_rest else {}
    wrench = np.abs(true_wrench(log, scenario.compliant))
    sensor = scenario.sensor
    return [
        *spring_claims(values, {"force": 0.02, "moment": 0.02}),
        at_most("drift of the force in the last second", value("drift"), 0.1, "N"),
        *(
            at_most(f"joint speed of {arm} while D rests", speeds.get(arm), 0.02, "rad/s, m/s")
            for arm in _redundant_arms(log)
        ),
        at_most("largest force component", wrench[:, 3:].max(), sensor.force_range, "N"),
        at_most("largest moment component", wrench[:, :3].max(), sensor.moment_range, "Nm"),
    ]


def _values_at_rest(log: Log, scenario: Any) -> dict[str, float]:
    body, rest = scenario.compliant, last_second(log)
    wrench = true_wrench(log, body)[rest]
    axes, felt = scenario.impedance.axes, []
    if axes in ("both", "translation") and _least(wrench[:, 3:]) > _LEAST_FORCE:
        felt.append("force")
    if axes in ("both", "rotation") and _least(wrench[:, :3]) > _LEAST_MOMENT:
        felt.append("moment")
    errors = spring_errors(log, body, scenario.impedance, rest, felt)
    return {"drift": drift(wrench[:, 3:]), **errors}


def _redundant_arms(log: Log) -> list[str]:
    return [key.removesuffix("/v") for key in log if key.endswith("/v") and log[key].shape[1] > 6]


def _joint_speeds(log: Log, scenario: Any) -> dict[str, float]:
    """Returns the largest joint speeds in the last second, which the hand does not show."""
    rest = last_second(log)
    if log[f"{scenario.compliant}/motion_D"][rest][:, VELOCITY].any():
        return {}
    return {arm: float(np.abs(log[f"{arm}/v"][rest]).max()) for arm in _redundant_arms(log)}


def _least(vectors: Any) -> float:
    return float(np.linalg.norm(vectors, axis=1).min())


def figures(log: Log, scenario: Any) -> dict[str, Figure]:
    """Returns displacement and wrench over time."""
    body, family = scenario.compliant, scenario.impedance.orientation
    return {
        "custom": interaction_figure(
            {f"{body}/wrench_true": log[f"{body}/wrench"], **log},
            body,
            orientation_displacement(log, body, scenario.impedance),
            title=f"six-DOF impedance control, {family}",
            orientation_label=ORIENTATION_LABELS[family],
            phases=phases_of(getattr(scenario, "segments", [])),
        )
    }
