"""An arm at its limits: E stays on C, joints stay inside, and nothing winds up."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from geoimp_drake.diagrams.experiments.at_limits import apart, arm_of, measured, torque_shares
from geoimp_drake.diagrams.experiments.measures import Log
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.simulation.claims import Claim, at_least, at_most
from geoimp_drake.simulation.figures import panels_figure
from geoimp_drake.simulation.style import figure_style, make_logarithmic
from geoimp_drake.systems.frame_motion import POSITION
from geoimp_drake.systems.sources.desired_motion import phases_of

__all__ = ["claims", "claims_across", "figure_across", "figures", "sweep_values"]

# By the name in `measured`: words, bound with limits kept, and unit.
_CLAIMS = {
    "distance": ("largest distance of E from C", 6.0, "mm"),
    "angle": ("largest angle of E from C", 1.0, "°"),
    "effort": ("largest torque over its limit", 1.0, ""),
    "speed": ("largest joint speed over its limit", 0.97, ""),
    "beyond": ("most that a joint is beyond an end of its range", 0.0, "rad, m"),
    "back": ("E is back at D later than by the law alone by", 0.4, "s"),
    "free": ("off the law in free directions, torques below their limits", 0.3, "N, Nm"),
    "bound": ("off the law in free directions, a torque at its limit", 20.0, "N, Nm"),
}
_ONLY_WITH_LIMITS = ("free", "bound")

# Least ratios without limits: the distance of E from C to that with limits, a torque to its limit.
_FARTHER, _STRONGER = 5.0, 1.5

_PANELS = ("distance", "effort", "speed")
_STYLES: dict[str, dict[str, Any]] = {
    "limits": {"color": "#0072B2", "marker": "o", "label": "with limits"},
    "none": {"color": "#D55E00", "marker": "X", "label": "limits: null"},
}

Runs = Mapping[str, tuple[Log, Any]]
Values = dict[str, float]


def claims(log: Log, scenario: SingleArmScenario) -> list[Claim]:
    """Returns the claims of a run; without limits its values are only reported."""
    values, kept = measured(log, scenario), scenario.limits is not None
    return [
        at_most(words, values.get(name), bound if kept else np.inf, unit)
        for name, (words, bound, unit) in _CLAIMS.items()
        if kept or name not in _ONLY_WITH_LIMITS
    ]


def sweep_values(log: Log, scenario: SingleArmScenario) -> dict[str, float | bool]:
    """Returns whether a sample succeeds; a missing value, such as the way back, does not count."""
    return {"success": all(claim.holds is not False for claim in claims(log, scenario))}


def figures(log: Log, scenario: SingleArmScenario) -> dict[str, Figure]:
    """Returns the distances of C from D and of E from C over time, and the largest torque."""
    arm = scenario.arm
    D, C, E = (log[f"{arm}/motion_{frame}"] for frame in "DCE")
    torque = torque_shares(log, arm, arm_of(scenario)).max(axis=1)
    panels = [
        ("C from D", "Δp_dc [mm]", 1e3 * (D - C)[:, POSITION], None),
        ("E from C", "‖Δp_ce‖ [mm]", 1e3 * apart(E, C)[0], 1.0),
        ("largest torque over its limit", "max |τ| / τ_max [-]", torque, 1.0),
    ]
    title = f"limits: {'kept' if scenario.limits is not None else 'null'}"
    return {"limits": panels_figure(log, arm, panels, title, phases_of(scenario.segments))}


def claims_across(runs: Runs) -> list[Claim]:
    """Returns the claims on each case without limits, against the same case with them."""
    claims = []
    for case, (kept, free) in _by_case(runs).items():
        if not kept or not free:
            continue
        ended = "back" in kept and "back" in free
        ratio = free["distance"] / kept["distance"] if ended else None
        torque = free["effort"] if ended else None
        claims += [
            at_least(f"{case}: E from C, without limits over with them", ratio, _FARTHER),
            at_least(f"{case}: without limits largest torque over its limit", torque, _STRONGER),
        ]
    return claims


def figure_across(runs: Runs) -> Figure:
    """Returns the distance of E from C, and torques and speeds over their limits, for each case."""
    cases = _by_case(runs)
    with figure_style():
        figure = Figure(figsize=(11, 1.6 + 0.42 * len(cases)))
        panels = figure.subplots(1, 3, sharey=True)
        for panel, name in zip(panels, _PANELS, strict=True):
            _plot_cases(panel, cases, name)
        panels[0].invert_yaxis()
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
        figure.suptitle("limits: each case with limits and without")
    return figure


def _plot_cases(panel: Axes, cases: Mapping[str, tuple[Values, Values]], name: str) -> None:
    """Plots a quantity with its bound, one line for each case."""
    words, bound, unit = _CLAIMS[name]
    for k, style in enumerate(_STYLES.values()):
        values = [values[k].get(name, np.nan) for values in cases.values()]
        panel.plot(values, list(cases), linestyle="", **style)
    panel.axvline(bound, color="#666666", linestyle=":", label="bound")
    make_logarithmic(panel, "x")
    panel.set_title(words)
    panel.set_xlabel(f"[{unit or '-'}]")


def _by_case(runs: Runs) -> dict[str, tuple[Values, Values]]:
    """Returns the values with limits and without, by case; a run is called KIND-CASE."""
    cases: dict[str, dict[str, Values]] = {}
    for name, run in runs.items():
        kind, _, case = name.partition("-")
        cases.setdefault(case.replace("-", " "), {})[kind] = measured(*run)
    return {case: (own.get("limits", {}), own.get("none", {})) for case, own in cases.items()}
