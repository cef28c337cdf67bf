"""Why the impedance has a stiff inner loop (section 3.3): model error and friction move E."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from geoimp_drake.campaigns.table import Table, cell_of
from geoimp_drake.diagrams.experiments.measures import (
    Log,
    orientation_angle,
    position_offset,
    true_wrench,
)
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.simulation.claims import Claim, at_least, at_most, phase_reached, within
from geoimp_drake.simulation.figures import panels_figure
from geoimp_drake.simulation.style import figure_style, make_logarithmic
from geoimp_drake.systems.sources.desired_motion import phases_of
from geoimp_drake.typing import Array

__all__ = ["claims", "claims_across", "figure_across", "figures", "measured", "tables_across"]

# Errors with the inner loop, for links twice as heavy and for friction as large as the effort
# limit. They are those of E from D [mm, °], and ‖f − K_p Δp_de‖ / ‖f‖.
_PER_ERROR = {"rest": (6.0, 200.0), "angle": (0.3, 30.0), "force": (0.1, 2.5)}
_LEAST = {"rest": 0.05, "angle": 0.01, "force": 1e-3}  # claimed for a known plant
_LAG = 1.0  # lag of servos, which know no model, behind their reference [mm]

# A scheme, the factor of the links' masses and the friction.
Case = tuple[str, float, float]
_HEAVY, _FRICTION = (1.1, 0.0), (1.0, 0.01)

_NATURAL = "natural inertia"
_COLOURS = {
    "inner-loop": "#0072B2",
    "direct": "#D55E00",
    _NATURAL: "#CC79A7",
    "admittance": "#009E73",
}
_MARKERS = {"inner-loop": "o", "direct": "s", _NATURAL: "D", "admittance": "^"}
_CELLS = (
    ("motion", "off D in motion [mm]", 1.0),
    ("rest", "at rest [mm]", 1.0),
    ("angle", "at rest [°]", 1.0),
    ("peak", "contact peak [N]", 1.0),
    ("force", "force off K_p Δp [%]", 100.0),
)
_TABLE_TEXT = (
    "One motion, 4 s of rest, and a press on a surface of 10⁴ N/m, with the same springs (700 N/m, "
    "2 Nm/rad) under each scheme; simulated here, from the true E and the true wrench. Motion and "
    "rest are the distance of E from D; the force is compared after three seconds of contact, and "
    "more than 100 % is a hand that does not press where it should."
)
_PANELS = (
    ("rest", "E from D at rest", "‖Δp_de‖ [mm]"),
    ("motion", "largest in free motion", "‖Δp_de‖ [mm]"),
    ("force", "force in contact", "‖f − K_p Δp_de‖ / ‖f‖ [%]"),
)


def measured(log: Log, scenario: SingleArmScenario) -> dict[str, float]:
    """Returns the values of a run, as far as it has come.

    Returns:
        `motion`, the largest ‖Δp_de‖ in free motion [mm]. `rest` and `angle`, the means of ‖Δp_de‖
        [mm] and of the angle of D from E [°] in the last second before the approach. `force`, the
        mean of ‖f − K_p Δp_de‖ / ‖f‖ in the last second of contact. `peak`, the largest ‖f‖ [N].
    """
    phases = {name: (begin, end) for name, begin, end in phases_of(scenario.segments)}
    offset, t = position_offset(log, scenario.arm), log["t"]
    values = {}
    if phase_reached(log, phases["rest"][1]):
        rest = _last_second_before(t, phases["rest"][1])
        values["motion"] = float(_norm(offset[t <= phases["free motion"][1]]).max())
        values["rest"] = float(_norm(offset[rest]).mean())
        values["angle"] = float(orientation_angle(log, scenario.arm)[rest].mean())
    if phase_reached(log, phases["hold"][1]):
        hold = _last_second_before(t, phases["hold"][1])
        force = true_wrench(log, scenario.arm)[:, 3:]
        values["peak"] = float(_norm(force).max())
        force = force[hold]
        spring = 1e-3 * offset[hold] @ scenario.impedance.gains("translation")[2].T
        values["force"] = float((_norm(force - spring) / _norm(force)).mean())
    return values


def claims(log: Log, scenario: SingleArmScenario) -> list[Claim]:
    """Returns the claims of a run, in proportion to errors that its controller does not know."""
    value, bound = measured(log, scenario).get, _bounds(scenario)
    return [
        at_most("at rest ‖Δp_de‖", value("rest"), bound["rest"], "mm"),
        at_most("at rest angle of E from D", value("angle"), bound["angle"], "°"),
        at_most("in free motion largest ‖Δp_de‖", value("motion"), bound["motion"], "mm"),
        at_most("in contact f = K_p Δp_de, relative error", value("force"), bound["force"]),
    ]


def figures(log: Log, scenario: SingleArmScenario) -> dict[str, Figure]:
    """Returns the distance of E from D over time, and the contact force."""
    panels = [
        ("E from D", "Δp_de [mm]", position_offset(log, scenario.arm), 1.0),
        ("angle of E from D", "ϑ_de [°]", orientation_angle(log, scenario.arm), 0.1),
        ("contact force", "f [N]", log[f"{scenario.arm}/wrench_true"][:, 3:], None),
    ]
    title = f"disturbance: {scenario.scheme}, {_words(scenario)}"
    return {
        "disturbance": panels_figure(log, scenario.arm, panels, title, phases_of(scenario.segments))
    }


def claims_across(runs: Mapping[str, tuple[Log, Any]]) -> list[Claim]:
    """Returns the claims that a direct impedance gives way more, and that servos do not at rest."""
    values = _by_case(runs)

    def ratio(name: str, error: tuple[float, float], scheme: str = "direct") -> float | None:
        own = values.get((scheme, *error), {}).get(name)
        inner = values.get(("inner-loop", *error), {}).get(name)
        return None if own is None or inner is None else own / inner

    heavier, friction = "links 10 % heavier", "Coulomb friction of 1 %"
    softness = [_softness(scenario) for _, scenario in runs.values()]
    return [
        at_least(f"{heavier}: offset at rest, direct over inner loop", ratio("rest", _HEAVY), 20),
        within(
            f"{heavier}: that ratio is K_Pp M_p / K_p", ratio("rest", _HEAVY), max(softness), 0.1
        ),
        at_least(f"{heavier}: angle at rest, direct over inner loop", ratio("angle", _HEAVY), 100),
        at_least(
            f"{friction}: offset at rest, direct over inner loop", ratio("rest", _FRICTION), 5
        ),
        at_least(
            f"{friction}: angle at rest, direct over inner loop", ratio("angle", _FRICTION), 30
        ),
        at_most(
            f"{heavier}: offset at rest, admittance over inner loop",
            ratio("rest", _HEAVY, "admittance"),
            0.01,
        ),
    ]


def figure_across(runs: Mapping[str, tuple[Log, Any]]) -> Figure:
    """Returns each quantity over the error of the links' masses, and over the friction."""
    values = _by_case(runs)
    with figure_style():
        figure = Figure(figsize=(11, 6.4), layout="constrained")
        axes = figure.subplots(2, 3, sharex="row", sharey="col")
        for column, (name, title, label) in enumerate(_PANELS):
            for row, words in enumerate(("links heavier by [%]", "Coulomb friction [% of effort]")):
                panel = axes[row, column]
                _plot_schemes(panel, values, name, of_mass=row == 0)
                panel.set_xlabel(words)
                panel.set_ylabel(label)
            axes[0, column].set_title(title)
        if values:
            axes[0, 0].legend(loc="center right")
        figure.suptitle("disturbance: what the controller does not know, under each scheme")
    return figure


def tables_across(runs: Mapping[str, tuple[Log, Any]]) -> list[Table]:
    """Returns the values of all runs, one row for each error and scheme."""
    values = {_row_words(own): measured(log, own) for log, own in runs.values()}
    errors = dict.fromkeys(words for words, _ in values)
    rows = tuple(
        (error, scheme, *(_cell(own, *column) for column in _CELLS))
        for error in errors
        for (words, scheme), own in values.items()
        if words == error
    )
    head = ("what the controller does not know", "scheme", *(title for _, title, _ in _CELLS))
    return [Table("Schemes under model error and friction", head, rows, _TABLE_TEXT)]


def _row_words(scenario: SingleArmScenario) -> tuple[str, str]:
    return _words(scenario), _scheme(scenario)


def _cell(values: Mapping[str, float], name: str, _: str, scale: float) -> str:
    if name == "force" and values.get(name, 0.0) > 1.0:
        return "> 100"
    return cell_of(scale * values[name] if name in values else None)


def _plot_schemes(
    panel: Axes, values: Mapping[Case, Mapping[str, float]], name: str, *, of_mass: bool
) -> None:
    """Plots a line for each scheme over the errors, and apart from it the value without errors."""
    scale = 100 if name == "force" else 1
    for scheme in dict.fromkeys(case[0] for case in values):
        points = {
            100 * (mass - 1.0 if of_mass else friction): scale * own[name]
            for (one, mass, friction), own in values.items()
            if one == scheme and name in own and (friction == 0.0 if of_mass else mass == 1.0)
        }
        errors = sorted(error for error in points if error > 0.0)
        style: dict[str, Any] = {"color": _COLOURS[scheme], "marker": _MARKERS[scheme]}
        panel.plot(errors, [points[error] for error in errors], label=scheme, **style)
        panel.plot(0.0, points.get(0.0, np.nan), linestyle="", **style)
    make_logarithmic(panel, "y")


def _scheme(scenario: SingleArmScenario) -> str:
    return _NATURAL if scenario.is_natural else scenario.scheme


def _by_case(runs: Mapping[str, tuple[Log, Any]]) -> dict[Case, dict[str, float]]:
    return {
        (_scheme(own), own.world.links.mass, own.world.joints.coulomb): measured(log, own)
        for log, own in runs.values()
    }


def _softness(scenario: SingleArmScenario) -> float:
    """Returns how much softer the impedance is than the inner loop, K_Pp M_p / K_p."""
    M_p, _, K_p = scenario.impedance.gains("translation")
    return float(scenario.motion.K_Pp * M_p[0, 0] / K_p[0, 0])


def _bounds(scenario: SingleArmScenario) -> dict[str, float]:
    """Returns the bounds of a run's claims, in the units of `measured`."""
    errors = abs(scenario.world.links.mass - 1.0), scenario.world.joints.coulomb
    direct = scenario.scheme == "direct"
    softness = _softness(scenario) if direct else 1.0
    bounds = {
        name: max(_LEAST[name], softness * float(np.dot(errors, per)))
        for name, per in _PER_ERROR.items()
    }
    bounds["motion"] = bounds["rest"]
    if direct:
        # A moment beyond the spring's turns the hand over, and friction stops it anywhere.
        loose = tuple(bounds) if scenario.world.joints.coulomb else ("angle",)
        bounds |= dict.fromkeys(loose, np.inf)
    if scenario.scheme == "admittance":
        bounds["motion"] = max(_LAG, 3.0 * bounds["rest"])
        # Integral parts hunt on dry friction: E keeps swinging by 0.7 mm about C.
        bounds["force"] *= 2.0
    if scenario.is_natural:
        # It still swings after three seconds of contact. Nothing is claimed for an unknown plant,
        # since its springs hold little weight.
        bounds = dict.fromkeys(bounds, np.inf) if any(errors) else {**bounds, "force": 0.02}
    return bounds


def _words(scenario: SingleArmScenario) -> str:
    mass, friction = scenario.world.links.mass, scenario.world.joints.coulomb
    words = [f"links {100 * (mass - 1.0):+.3g} %"] if mass != 1.0 else []
    words += [f"friction of {100 * friction:.3g} %"] if friction else []
    return " and ".join(words) or "the plant as known"


def _last_second_before(t: Array, end: float) -> Array:
    return (t >= end - 1.0) & (t <= end)


def _norm(vectors: Array) -> Array:
    return np.linalg.norm(vectors, axis=1)
