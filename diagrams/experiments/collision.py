"""An arm that runs into somebody: the peak force with each measure of the safety limits."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.diagrams.experiments.measures import Log
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.simulation.claims import (
    FAILS,
    NOT_REACHED,
    Claim,
    at_least,
    at_most,
    phase_reached,
)
from geoimp_drake.simulation.figures import panels_figure
from geoimp_drake.simulation.style import figure_style, make_logarithmic
from geoimp_drake.systems.frame_motion import LINEAR_VELOCITY, POSITION
from geoimp_drake.systems.sources.desired_motion import phases_of

__all__ = ["claims", "claims_across", "figure_across", "figures", "measured", "sweep_values"]

# Colour and marker of the measures: the markers tell them apart without colour, and where points
# coincide.
_MARKS = {
    "none": ("#D55E00", "x"),
    "reaction": ("#E69F00", "s"),
    "cap": ("#56B4E9", "D"),
    "leash": ("#0072B2", "^"),
    "all": ("#009E73", "o"),
}
_WORDS = {
    "none": "without",
    "reaction": "reaction alone",
    "cap": "cap alone",
    "leash": "cap and leash",
    "all": "cap, leash, reaction",
}

# The words of the figure for the last part of a case's name.
_CASES = {"down": "from above", "side": "from the side", "free": "free to move"}

Runs = Mapping[str, tuple[Log, Any]]


def measured(log: Log, scenario: SingleArmScenario) -> dict[str, float]:
    """Returns the values of a run.

    Returns:
        `peak`, the largest contact force [N]. If there was a contact: `speed`, that of E as it
        began [m/s], and `left`, the force that remained at the end [N].
    """
    force = log["body/force"][:, 0]
    values = {"peak": float(force.max())}
    if force.any():
        first = int(np.argmax(force > 0.0))
        velocity = log[f"{scenario.arm}/motion_E"][first, LINEAR_VELOCITY]
        values |= {"speed": float(np.linalg.norm(velocity)), "left": float(force[-1])}
    return values


def claims(log: Log, scenario: SingleArmScenario) -> list[Claim]:
    """Returns the claim on the peak if all measures are on; else the peak is only reported."""
    ended = phase_reached(log, scenario.length)
    values = measured(log, scenario) if ended else {}
    safety = scenario.safety
    whole = safety is not None and safety.cap and safety.leash and safety.detection is not None
    bound = safety.force if safety is not None and whole else np.inf
    damping = np.linalg.eigvalsh(scenario.impedance.gains("translation")[1]).min()
    return [
        at_most("largest force on the body", values.get("peak"), bound, "N"),
        at_most("force that is left at the end", values.get("left"), bound, "N"),
        at_most("speed of the hand as it touches", values.get("speed"), bound / damping, "m/s"),
    ]


def sweep_values(log: Log, scenario: SingleArmScenario) -> dict[str, float | bool]:
    """Returns whether a sample hits its body within its limit, and the peak."""
    holds = all(claim.verdict not in (FAILS, NOT_REACHED) for claim in claims(log, scenario))
    return {"success": holds, "peak": measured(log, scenario)["peak"]}


def figures(log: Log, scenario: SingleArmScenario) -> dict[str, Figure]:
    """Returns contact force, speeds and the displacement of D over time."""
    D, E = (log[f"{scenario.arm}/motion_{frame}"] for frame in "DE")
    panels = [
        ("force on the body", "f [N]", log["body/force"][:, 0], 1.0),
        ("speed of the hand", "‖v_e‖ [m/s]", np.linalg.norm(E[:, LINEAR_VELOCITY], axis=1), 0.1),
        ("D from its start", "Δp_d [mm]", 1e3 * (D - D[0])[:, POSITION], None),
    ]
    return {
        "collision": panels_figure(
            log, scenario.arm, panels, "collision", phases_of(scenario.segments)
        )
    }


def claims_across(runs: Runs) -> list[Claim]:
    """Returns the claims: with all measures each case keeps its limit, without them none does."""
    claims = []
    for case, peaks in _by_case(runs).items():
        if "all" in peaks:
            most = peaks["all"]["limit"]
            claims.append(at_most(f"{case}: peak with all", peaks["all"].get("peak"), most, "N"))
            if "none" in peaks:
                words = f"{case}: peak without safety"
                claims.append(at_least(words, peaks["none"].get("peak"), most, "N"))
    return claims


def figure_across(runs: Runs) -> Figure:
    """Returns the peak of each case with each of the measures, and the limit."""
    cases = _by_case(runs)
    with figure_style():
        figure = Figure(figsize=(9, 1.8 + 0.35 * len(cases)))
        axes = figure.subplots()
        for kind, words in _WORDS.items():
            peaks = [own.get(kind, {}).get("peak", np.nan) for own in cases.values()]
            colour, marker = _MARKS[kind]
            axes.plot(
                peaks,
                [_in_words(case) for case in cases],
                marker,
                color=colour,
                fillstyle="none",
                markeredgewidth=1.5,
                label=words,
            )
        for limit in {own["limit"] for kinds in cases.values() for own in kinds.values()}:
            axes.axvline(limit, color="#666666", linestyle=":", label="limit")
        make_logarithmic(axes, "x")
        axes.invert_yaxis()
        axes.set_xlabel("largest force on the body [N]")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        figure.suptitle("collision: with and without each measure")
    return figure


def _in_words(case: str) -> str:
    """Returns a case as the figure names it, such as `hand, from above`."""
    body, _, how = case.rpartition(" ")
    return f"{body}, {_CASES.get(how, how)}"


def _by_case(runs: Runs) -> dict[str, dict[str, dict[str, float]]]:
    """Returns the values by case and by measures; a run is called MEASURES-CASE."""
    cases: dict[str, dict[str, dict[str, float]]] = {}
    limit = next((own.safety.force for _, own in runs.values() if own.safety is not None), np.inf)
    for name, run in runs.items():
        kind, _, case = name.partition("-")
        values = measured(*run) if phase_reached(run[0], run[1].length) else {}
        own = limit if run[1].safety is None else run[1].safety.force
        cases.setdefault(case.replace("-", " "), {})[kind] = {**values, "limit": own}
    return cases
