"""Measures that tell orientation springs apart, from their laws alone, without a simulation.

- (a) the work round a closed loop of orientations;
- (b) whether the moment of a turn about a principal axis of the stiffness is about that axis;
- (c) the moment near a half turn and near the singularities of Euler angles;
- (d) the moment if a target comes as −Q instead of Q, the same orientation.
"""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.diagrams.experiments.peer_springs import SPRINGS, Spring, seo_stiffness
from geoimp_drake.diagrams.scene.turning_hand import orientation_loop
from geoimp_drake.rotations import quaternion, so3
from geoimp_drake.simulation.style import figure_style
from geoimp_drake.typing import Array

__all__ = [
    "LOOP_STIFFNESS",
    "SPRING_STYLES",
    "moment_at",
    "springs_figure",
    "springs_table",
    "work_round",
]

LOOP_STIFFNESS = np.diag([4.0, 10.0, 2.5])  # [Nm/rad]

# Attitude of the law's own axes, in which K_o is diagonal.
_PRINCIPAL_AXES = so3.exp(np.array([0.5, -0.4, 0.7]))
_TILTED = quaternion.exp(np.array([0.3, 0.5, -0.4]))
_IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
_PITCHED = quaternion.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.radians(88.0))

# A target turned by 40°.
_AXIS = np.array([0.48, 0.6, -0.64])
_TARGET = quaternion.from_axis_angle(_AXIS, np.radians(40.0))

# By spring: those without work on a closed loop are solid.
SPRING_STYLES: dict[str, dict[str, Any]] = {
    "quaternion": {"color": "#0072B2", "marker": "o"},
    "angle-axis-simple": {"color": "#56B4E9", "marker": "s"},
    "seo": {"color": "#000000", "marker": ".", "linestyle": (0, (1, 3))},
    "axis-angle": {"color": "#D55E00", "marker": "^", "linestyle": "--"},
    "quaternion-vector": {"color": "#CC79A7", "marker": "v", "linestyle": "--"},
    "cross-products": {"color": "#E69F00", "marker": "D", "linestyle": "--"},
    "classical-euler": {"color": "#666666", "marker": "x", "linestyle": ":"},
    "alternative-euler": {"color": "#009E73", "marker": "+", "linestyle": ":"},
}


def moment_at(spring: Spring, Q_CD: Array, K_o: Array, Q_WD: Array = _IDENTITY) -> Array:
    """Returns ᶜμ (3,) [Nm] at a relative orientation; the measured attitude of C has η ≥ 0.

    Args:
        spring: the one that gives the moment.
        Q_CD: orientation of D seen from C (4,).
        K_o: stiffness (3, 3) [Nm/rad].
        Q_WD: attitude of D (4,).
    """
    Q_WC = quaternion.product(Q_WD, quaternion.conjugate(Q_CD))
    return spring.moment(Q_WD, quaternion.canonical(Q_WC), K_o)


def work_round(spring: Spring, K_o: Array = LOOP_STIFFNESS, steps: int = 1000) -> Array:
    """Returns the energy that a hand has taken out along the loop (steps + 1,) [J].

    Whoever turns C round `orientation_loop` gets ∫ ᶜμᵀ ᶜω_c dt, while D rests. In the other
    direction the lap gives the negative of it.
    """
    s = np.linspace(0.0, 2.0 * np.pi, steps + 1)
    middles = 0.5 * (s[1:] + s[:-1])
    taken = [
        moment_at(spring, orientation_loop(middle), K_o) @ _turn_of_C(first, last)
        for first, middle, last in zip(s[:-1], middles, s[1:], strict=True)
    ]
    return np.concatenate(([0.0], np.cumsum(taken)))


def _turn_of_C(first: float, last: float) -> Array:
    """Returns the small rotation vector of C, in C, from one place of the loop to another."""
    before, after = orientation_loop(first), orientation_loop(last)
    return -quaternion.log(quaternion.product(after, quaternion.conjugate(before)))


def _misalignment(spring: Spring, K_o: Array, axis: int, degrees: float) -> float:
    """Returns the sine of the angle between moment and axis, for a turn about a principal axis."""
    U, turn = _PRINCIPAL_AXES, np.radians(degrees)
    Q_CD = quaternion.from_axis_angle(U[:, axis], turn)
    moment = moment_at(spring, Q_CD, U @ K_o @ U.T, _TILTED)
    return float(np.linalg.norm(so3.cross(U[:, axis], moment)) / np.linalg.norm(moment))


def _held(spring: Spring, degrees: float) -> float:
    """Returns the moment about x for a turn about x, with stiffness one [rad]."""
    axis = np.array([1.0, 0.0, 0.0])
    Q_CD = quaternion.from_axis_angle(axis, np.radians(degrees))
    return float(moment_at(spring, Q_CD, np.eye(3)) @ axis)


def _near_pitch(spring: Spring, Q_WD: Array, Q_CD: Array) -> float:
    """Returns the largest moment for 5° more about any axis, divided by that of a linear spring."""
    gains = []
    for axis in np.eye(3):
        turned = quaternion.product(quaternion.from_axis_angle(axis, np.radians(5.0)), Q_CD)
        moment = moment_at(spring, turned, np.eye(3), Q_WD)
        gains.append(np.linalg.norm(moment) / np.linalg.norm(quaternion.log(turned)))
    return float(max(gains))


def _sign_change(spring: Spring, K_o: Array) -> float:
    """Returns the relative change of the moment when the target comes as −Q."""
    one, other = (spring.moment(Q, _IDENTITY, K_o) for Q in (_TARGET, -_TARGET))
    return float(np.linalg.norm(one - other) / np.linalg.norm(one))


def _note(name: str, K_o: Array, before: str = "") -> str:
    """Returns a note on a spring with a stiffness, after the text `before`; or an empty text."""
    least = float(np.linalg.eigvalsh(seo_stiffness(K_o))[0])
    return f"{before}K_R has the eigenvalue {least:.3g}" if name == "seo" and least <= 0.0 else ""


def springs_table(K_o: Array = LOOP_STIFFNESS) -> list[dict[str, str | float]]:
    """Returns one row for each spring, by column title.

    Args:
        K_o: stiffness of the work, the misalignment and the flipped sign (3, 3) [Nm/rad].
    """
    return [
        {
            "spring": spring.title,
            "moment in C": spring.formula,
            "source": spring.source,
            "note": _note(name, K_o),
            "taken out a lap; the other way its negative [J]": float(work_round(spring, K_o)[-1]),
            "largest misalignment, turns of 30° [-]": max(
                _misalignment(spring, K_o, axis, 30.0) for axis in range(3)
            ),
            "moment at 90° [k rad]": _held(spring, 90.0),
            "moment at 179° [k rad]": _held(spring, 179.0),
            "jump at 180° [k rad]": abs(_held(spring, 179.999) - _held(spring, 180.001)),
            "gain, hand at pitch 88° [-]": _near_pitch(spring, _PITCHED, _IDENTITY),
            "gain, turned by 88° in pitch [-]": _near_pitch(spring, _IDENTITY, _PITCHED),
            "change as the target comes as −Q [-]": _sign_change(spring, K_o),
        }
        for name, spring in SPRINGS.items()
    ]


def springs_figure(K_o: Array = LOOP_STIFFNESS) -> Figure:
    """Returns the springs side by side: (a) to (d) of this module, a panel each."""
    turns, angles = np.linspace(2.0, 80.0, 40), np.linspace(0.0, 210.0, 421)
    with figure_style():
        figure = Figure(figsize=(10, 7.2))
        (work, aligned), (held, flipped) = figure.subplots(2, 2)
        for name, spring in SPRINGS.items():
            label = f"{spring.title}{_note(name, K_o, '; ')}"
            style = {**SPRING_STYLES[name], "label": label, "markersize": 4}
            taken = work_round(spring, K_o, 120)
            work.plot(np.linspace(0.0, 1.0, len(taken)), taken, markevery=12, **style)
            sines = [_misalignment(spring, K_o, 2, turn) for turn in turns]
            aligned.plot(turns, sines, markevery=5, **style)
            moments = [_moment_in_pitch(spring, angle) for angle in angles]
            held.plot(angles, moments, markevery=40, **style)
            flipped.plot(range(9), _moments_of_target(spring, K_o), drawstyle="steps-mid", **style)
        work.set(title="(a) turned round a closed loop", xlabel="way along the loop [laps]")
        work.set_ylabel("energy taken out [J]")
        aligned.set(title="(b) turned about a principal axis", xlabel="turn [°]")
        aligned.set_ylabel("sine between moment and axis [-]")
        held.set(title="(c) turned on and on, 6° beside the axis", xlabel="turn in pitch [°]")
        held.set(ylabel="moment about the pitch axis [k rad]", ylim=(-4.5, 4.5))
        flipped.set(title="(d) a target, from sample 4 on given as −Q", xlabel="sample")
        flipped.set_ylabel("moment about the turn's axis [Nm]")
        figure.legend(*work.get_legend_handles_labels(), loc="outside lower center", ncols=4)
        figure.suptitle("orientation springs side by side, of the same stiffness for small turns")
    return figure


def _moment_in_pitch(spring: Spring, degrees: float) -> float:
    """Returns the moment about y for a turn nearly about y, with stiffness one [rad]."""
    y = np.array([0.0, 1.0, 0.0])
    beside = quaternion.exp(np.radians(np.array([5.0, 0.0, 3.0])))
    Q_CD = quaternion.product(beside, quaternion.from_axis_angle(y, np.radians(degrees)))
    return float(moment_at(spring, Q_CD, np.eye(3)) @ y)


def _moments_of_target(spring: Spring, K_o: Array) -> list[float]:
    """Returns the moments about the axis of a target at rest that changes its sign [Nm]."""
    moments = [float(spring.moment(Q, _IDENTITY, K_o) @ _AXIS) for Q in (_TARGET, -_TARGET)]
    return [moments[0]] * 4 + [moments[1]] * 5
