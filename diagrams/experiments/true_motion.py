"""The true motion of a run beside that which its controller knows, in one figure."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.diagrams.experiments.measures import Log
from geoimp_drake.diagrams.setups.tight_scenario import OBJECT
from geoimp_drake.rotations import quaternion
from geoimp_drake.simulation.style import figure_style, keep_noise_small
from geoimp_drake.systems.frame_motion import POSITION, QUATERNION
from geoimp_drake.typing import Array

__all__ = ["true_motion_figures"]

# Keys of the log: the true end effector or object, and the one that the controller knows.
_PLACES = {"true": "motion_E", "as the controller knows it": "motion_E_known"}
_PLACES_OF_OBJECT = {"true": "motion_bar", "as the controller knows it": "motion_O"}


def true_motion_figures(log: Log, scenario: Any) -> dict[str, Figure]:
    """Returns the distance of E, or of the object O, from C: the true one, and the controller's.

    There is no figure if the plant is as the controller knows it.
    """
    if scenario.world.is_none():
        return {}
    arm = scenario.compliant
    places = _PLACES_OF_OBJECT if arm == OBJECT else _PLACES
    offsets = {words: _offset(log, arm, key) for words, key in places.items()}
    wrench = {
        words: np.linalg.norm(log[key][:, 3:], axis=1)
        for words, key in (("true", f"{arm}/wrench_true"), ("measured", f"{arm}/wrench"))
        if key in log
    }
    letter = "o" if arm == OBJECT else "e"
    with figure_style():
        figure = Figure(figsize=(13.5, 3.4))
        panels = (
            ("distance from C", f"‖p_c{letter}‖ [mm]", {w: d for w, (d, _) in offsets.items()}),
            ("angle from C", f"ϑ_c{letter} [°]", {w: a for w, (_, a) in offsets.items()}),
            ("contact force", "‖f‖ [N]", wrench),
        )
        for axes, (title, label, curves) in zip(figure.subplots(1, 3), panels, strict=True):
            for (words, values), style in zip(curves.items(), ("-", "--"), strict=False):
                axes.plot(log["t"], values, style, label=words)
            axes.set_title(title)
            axes.set_xlabel("time [s]")
            axes.set_ylabel(label)
            axes.set_ylim(bottom=0.0)
            keep_noise_small(axes)
            axes.legend()
        figure.suptitle(f"{scenario.experiment}: a plant that is not the controller's model")
    return {"true_motion": figure}


def _offset(log: Log, arm: str, key: str) -> tuple[Array, Array]:
    """Returns distance [mm] and angle [°] of a frame from C over time (N)."""
    C, F = log[f"{arm}/motion_C"], log[f"{arm}/{key}"]
    distance = 1e3 * np.linalg.norm((F - C)[:, POSITION], axis=1)
    half = [
        np.linalg.norm(quaternion.relative(Q_WC, Q_WF)[1:])
        for Q_WC, Q_WF in zip(C[:, QUATERNION], F[:, QUATERNION], strict=True)
    ]
    return distance, np.degrees(2.0 * np.arcsin(np.minimum(half, 1.0)))
