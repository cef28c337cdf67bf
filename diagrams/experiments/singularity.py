"""Case study 2: the claims of `singularity`, and Figs 5.4 and 5.5."""

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.diagrams.experiments.measures import Log, conditioning, ended_in_contact
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.simulation.claims import Claim, at_least, at_most, last_second
from geoimp_drake.simulation.figures import panels_figure
from geoimp_drake.systems.sources.desired_motion import phases_of

__all__ = ["claims", "figures", "held_and_peak"]


def held_and_peak(log: Log, arm: str) -> dict[str, float]:
    """Returns the norms of moment and force: held (mean of the last second) and at their peak."""
    wrench = log[f"{arm}/wrench_true"]
    rest = last_second(log)
    norms = {
        "moment": np.linalg.norm(wrench[:, :3], axis=1),
        "force": np.linalg.norm(wrench[:, 3:], axis=1),
    }
    held = {f"held {name}": float(norm[rest].mean()) for name, norm in norms.items()}
    return held | {f"peak {name}": float(norm.max()) for name, norm in norms.items()}


def claims(log: Log, scenario: SingleArmScenario) -> list[Claim]:
    """Returns the claims of the second case study for the family that was run.

    The ratios between families are claims of `geoimp compare singularity`.
    """
    values = held_and_peak(log, scenario.arm) if ended_in_contact(log, scenario.segments) else {}
    value = values.get
    cond = float(conditioning(log, scenario.arm, scenario.impedance).max())
    if scenario.impedance.orientation == "classical-euler":
        return [
            at_least("held contact moment", value("held moment"), 1.0, "Nm"),
            at_least("held contact force", value("held force"), 25.0, "N"),
            at_least("largest cond(T), the cause", cond, 10.0),
        ]
    return [
        at_most("held contact moment", value("held moment"), 0.6, "Nm"),
        at_most("held contact force", value("held force"), 15.0, "N"),
        at_most("peak contact moment", value("peak moment"), 1.5, "Nm"),
        at_most("largest cond(T)", cond, 10.0),
    ]


def figures(log: Log, scenario: SingleArmScenario) -> dict[str, Figure]:
    """Returns Fig 5.4, and Fig 5.5 with a panel of cond(T) for classical Euler angles."""
    family = scenario.impedance.orientation
    wrench = log[f"{scenario.arm}/wrench"]
    classical = family == "classical-euler"
    panels = [
        ("contact force", "f [N]", wrench[:, 3:], 0.0),
        ("contact moment", "μ [Nm]", wrench[:, :3], 0.0),
    ]
    if classical:
        panels.append(
            (
                "conditioning of T(φ_c)",
                "cond(T) [-]",
                conditioning(log, scenario.arm, scenario.impedance),
                10.0,
            )
        )
    figure = panels_figure(
        log, scenario.arm, panels, f"singularity: {family}", phases_of(scenario.segments)
    )
    return {"figure_5_5" if classical else "figure_5_4": figure}
