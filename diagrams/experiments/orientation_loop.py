"""Which springs give energy away when somebody turns the end effector round a closed loop?

The hand's work goes into the spring and into the damper. The damper takes energy in either
direction. The rest of a lap is the spring's work, which is zero if the spring has a potential.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.diagrams.experiments.measures import Log
from geoimp_drake.diagrams.experiments.peer_springs import SPRINGS
from geoimp_drake.diagrams.experiments.spring_measures import SPRING_STYLES
from geoimp_drake.diagrams.setups.turned_arm_scenario import TurnedArmScenario
from geoimp_drake.parts.impedance_energy import ImpedanceEnergy
from geoimp_drake.rotations import quaternion
from geoimp_drake.simulation.claims import Claim, at_least, at_most, phase_reached, within
from geoimp_drake.simulation.figures import panels_figure
from geoimp_drake.simulation.style import figure_style, keep_noise_small, shade_phases
from geoimp_drake.systems.frame_motion import ANGULAR_VELOCITY, QUATERNION
from geoimp_drake.typing import Array

__all__ = [
    "claims",
    "claims_across",
    "energies",
    "figure_across",
    "figures",
    "laps",
]

Runs = Mapping[str, tuple[Log, Any]]

# Energy of a spring with a potential; of one without, with this experiment's stiffness [J].
_NOTHING, _SOMETHING = 0.05, 3.0


def energies(log: Log, scenario: TurnedArmScenario) -> tuple[Array, Array]:
    """Returns the energy that the hand has taken out, and that from the spring, over time [J].

    The second is the sum of the first and the damper's (N each).
    """
    arm, energy = scenario.arm, ImpedanceEnergy(log[f"{scenario.arm}/energy"].T)
    w_WE = log[f"{arm}/motion_E"][:, ANGULAR_VELOCITY]
    taken = -_integral(log["t"], np.sum(log["hand/moment"] * w_WE, axis=1))
    return taken, taken + _integral(log["t"], energy.rotational_dissipated_power)


def _integral(t: Array, power: Array) -> Array:
    steps = 0.5 * (power[1:] + power[:-1]) * np.diff(t)
    return np.concatenate(([0.0], np.cumsum(steps)))


def laps(log: Log, scenario: TurnedArmScenario, energy: Array) -> dict[str, Array]:
    """Returns the growth of an energy (N) in each lap and the rest after it, by direction."""
    rest = scenario.hand.rest
    grown: dict[str, Array] = {}
    for name, begin, end in scenario.hand.phases():
        if name != "lead":
            first, last = np.interp((begin, end + rest), log["t"], energy)
            grown[name] = np.append(grown.get(name, np.array([])), last - first)
    return grown


def claims(log: Log, scenario: TurnedArmScenario) -> list[Claim]:
    """Returns the claims: a lap leaves nothing, or joules with another controller's spring."""
    values: dict[str, float] = {}
    if phase_reached(log, scenario.hand.duration):
        taken, spring = (laps(log, scenario, energy) for energy in energies(log, scenario))
        forward, back = spring["forward"], spring["back"]
        values = {
            "turn": float(np.degrees(np.linalg.norm(_turn(log, scenario), axis=1).max())),
            "most": float(max(np.abs(forward).max(), np.abs(back).max())),
            "forward": float(forward.max()),
            "back": float(back.min()),
            "ratio": float(forward.mean() / back.mean()),
            "taken": float(taken["back"].min()),
        }
    value = values.get
    turned = at_least("largest turn of E from D", value("turn"), 60.0, "°")
    if scenario.impedance.spring is None:
        most = at_most("energy out of the spring a lap, at most", value("most"), _NOTHING, "J")
        return [turned, most]
    return [
        turned,
        at_most("energy out of the spring, a lap forward", value("forward"), -_SOMETHING, "J"),
        at_least("energy out of the spring, a lap back", value("back"), _SOMETHING, "J"),
        within("the one over the other", value("ratio"), -1.0, 0.05),
        at_least("energy in the hand after a lap back, damper and all", value("taken"), 0.5, "J"),
    ]


def figures(log: Log, scenario: TurnedArmScenario) -> dict[str, Figure]:
    """Returns the rotation of E, the moment of the hand, and the energy from the spring."""
    panels = [
        ("turn of E from D, in D", "ϑr [rad]", _turn(log, scenario), None),
        ("moment of the hand", "μ [Nm]", log["hand/moment"], None),
        ("energy out of the spring", "E [J]", energies(log, scenario)[1], None),
    ]
    title = f"orientation_loop: {SPRINGS[_name(scenario)].title}"
    phases = list(scenario.hand.phases())
    return {"orientation_loop": panels_figure(log, scenario.arm, panels, title, phases)}


def _turn(log: Log, scenario: TurnedArmScenario) -> Array:
    """Returns the rotation vector of E from D over time, in D (N×3) [rad]."""
    D, E = (log[f"{scenario.arm}/motion_{frame}"][:, QUATERNION] for frame in "DE")
    relative = (quaternion.relative(Q_WD, Q_WE) for Q_WD, Q_WE in zip(D, E, strict=True))
    return np.array([quaternion.log(Q_DE) for Q_DE in relative])


def _name(scenario: TurnedArmScenario) -> str:
    """Returns the name of the spring, its own or the family's."""
    return scenario.impedance.spring or scenario.impedance.orientation


def claims_across(runs: Runs) -> list[Claim]:
    """Returns the claims that springs with a potential give nothing away, and the others do."""
    largest: dict[bool, list[float]] = {True: [], False: []}
    for log, scenario in runs.values():
        if phase_reached(log, scenario.hand.duration):
            forward = laps(log, scenario, energies(log, scenario)[1])["forward"]
            largest[scenario.impedance.spring is None].append(float(np.abs(forward).max()))
    ours, theirs = largest[True], largest[False]
    return [
        *(at_most("a lap, springs with a potential", max(ours), _NOTHING, "J") for _ in ours[:1]),
        *(at_least("a lap, those without", min(theirs), _SOMETHING, "J") for _ in theirs[:1]),
    ]


def figure_across(runs: Runs) -> Figure:
    """Returns the energy from each spring since the first lap began, and lap by lap."""
    with figure_style():
        figure = Figure(figsize=(10, 4.6))
        over_time, by_lap = figure.subplots(1, 2)
        for log, scenario in runs.values():
            name = _name(scenario)
            style = {**SPRING_STYLES[name], "label": SPRINGS[name].title}
            phases, spring = list(scenario.hand.phases()), energies(log, scenario)[1]
            spring -= np.interp(phases[1][1], log["t"], spring)
            over_time.plot(log["t"], spring, markevery=max(len(spring) // 12, 1), **style)
            if phase_reached(log, scenario.hand.duration):
                forward, back = laps(log, scenario, spring).values()
                number = range(1, 1 + len(forward) + len(back))
                by_lap.plot(number, np.append(forward, back), **style)
                by_lap.set_xticks(number)
        over_time.set(title="out of the spring since the first lap", ylabel="energy [J]")
        over_time.set_xlabel("time [s]")
        shade_phases(over_time, phases, label=True)
        by_lap.set(title="out of the spring in each lap: forward, then back", xlabel="lap")
        by_lap.set_ylabel("energy a lap [J]")
        for axes in (over_time, by_lap):
            keep_noise_small(axes)
        figure.legend(*over_time.get_legend_handles_labels(), loc="outside lower center", ncols=4)
        figure.suptitle("orientation_loop: somebody turns the hand round a closed loop and back")
    return figure
