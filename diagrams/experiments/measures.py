"""Measures of the experiments' logs; nothing here judges or draws.

`arm` is the name under which motions and wrench are logged: of an arm, or `object`.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from geoimp_drake.controllers.impedance_config import ImpedanceConfig
from geoimp_drake.diagrams.setups.tight_scenario import ARMS, OBJECT
from geoimp_drake.laws.impedance.orientation_impedance import OrientationImpedance
from geoimp_drake.laws.impedance.translational_impedance import turned
from geoimp_drake.rotations import quaternion, so3
from geoimp_drake.simulation.claims import Claim, at_most, blind, phase_reached
from geoimp_drake.systems.frame_motion import POSITION, QUATERNION
from geoimp_drake.systems.sources.desired_motion import MotionSegment, length_of
from geoimp_drake.typing import Array

__all__ = [
    "ORIENTATION_LABELS",
    "PARTS",
    "Log",
    "conditioning",
    "drift",
    "end_reached",
    "ended_in_contact",
    "force_spring_error",
    "misalignment",
    "moment_spring_error",
    "orientation_angle",
    "orientation_displacement",
    "position_offset",
    "quaternion_error",
    "spring_claims",
    "spring_errors",
    "spring_force",
    "true_motion",
    "true_wrench",
]

Log = dict[str, Array]

PARTS = "force", "moment"  # of the wrench
_TRUE = "true "
_WORDS = {
    "force": "at rest f = K_p Δp_dc, relative error",
    "moment": "at rest ᶜμ = K'_o ᶜε_dc, relative error",
    f"{_TRUE}force": "at rest f = K_p Δp_de, true f and E, relative error",
    f"{_TRUE}moment": "at rest ᵉμ = K'_o ᵉε_de, true μ and E, relative error",
}

ORIENTATION_LABELS = {
    "quaternion": "ᶜε_dc [-]",
    "classical-euler": "Δφ_dc [rad]",
    "alternative-euler": "φ_dc [rad]",
    "angle-axis-simple": "ϑ r_dc [rad]",
    "angle-axis-sin": "sin ϑ r_dc [-]",
    "angle-axis-sin-half": "sin(ϑ/2) r_dc [-]",
    "angle-axis-tan-half": "tan(ϑ/2) r_dc [-]",
}


def end_reached(log: Log, segments: Sequence[MotionSegment]) -> bool:
    """Returns whether the run reached the end of its motion."""
    return phase_reached(log, length_of(segments))


def ended_in_contact(log: Log, segments: Sequence[MotionSegment]) -> bool:
    """Returns whether the motion has ended and there is a surface to press on."""
    return "surface/plane" in log and end_reached(log, segments)


def orientation_displacement(log: Log, arm: str, impedance: ImpedanceConfig) -> Array:
    """Returns the displacement of C from D in the family's own coordinates over time (N×3)."""
    return np.array([family.displacement(D, C) for family, D, C in _attitudes(log, arm, impedance)])


def conditioning(log: Log, arm: str, impedance: ImpedanceConfig) -> Array:
    """Returns cond(T) of the family's Euler angles over time (N); one for other families."""
    return np.array([family.conditioning(D, C) for family, D, C in _attitudes(log, arm, impedance)])


def true_motion(log: Log, arm: str) -> Array:
    """Returns the motion of E, or of the object, over time as it is in the plant (N×19)."""
    return log[f"{arm}/motion_bar" if arm == OBJECT else f"{arm}/motion_E"]


def true_wrench(log: Log, arm: str) -> Array:
    """Returns the wrench on the environment over time without the sensors' errors (N×6).

    For a user's own robot only the measured one is known.
    """
    if arm != OBJECT:
        return log.get(f"{arm}/wrench_true", log[f"{arm}/wrench"])
    # The object's wrench as the controller sees it, less the errors of both hands' sensors.
    wrench, p_WO = log[f"{OBJECT}/wrench"].copy(), log[f"{OBJECT}/motion_O"][:, POSITION]
    for hand in ARMS:
        h = log[f"{hand}/wrench_true"] - log[f"{hand}/wrench"]
        lever = log[f"{hand}/motion_E"][:, POSITION] - p_WO
        wrench[:, :3] += h[:, :3] + np.cross(lever, h[:, 3:])
        wrench[:, 3:] += h[:, 3:]
    return wrench


def drift(values: Array) -> float:
    """Returns the largest difference, in one component, of the means of two halves (N×3)."""
    first, second = (half.mean(axis=0) for half in np.array_split(values, 2))
    return float(np.abs(second - first).max())


def spring_force(
    log: Log, arm: str, impedance: ImpedanceConfig, samples: Array, *, true: bool = False
) -> Array:
    """Returns K_p Δp_dc in W over some samples (N×3) [N]; K_p Δp_de of the true E if `true`."""
    D, F = log[f"{arm}/motion_D"][samples], _followed(log, arm, true)[samples]
    _, _, K_p = impedance.gains("translation")
    displacement = D[:, POSITION] - F[:, POSITION]
    if not impedance.stiffness_is_in_desired():
        return displacement @ K_p.T
    attitudes = map(quaternion.to_rotation, D[:, QUATERNION])
    return np.array(
        [turned(K_p, R_WD) @ dp for R_WD, dp in zip(attitudes, displacement, strict=True)]
    )


def force_spring_error(
    log: Log, arm: str, impedance: ImpedanceConfig, samples: Array, *, true: bool = False
) -> float:
    """Returns ‖f − K_pΔp_dc‖ / ‖f‖ of the means over some samples: (3.1) at rest.

    No plant breaks this, since f is measured, and C follows from it. With `true`, f and E are the
    plant's.
    """
    spring = spring_force(log, arm, impedance, samples, true=true)
    return _relative_error(_wrench(log, arm, true)[samples, 3:], spring)


def moment_spring_error(
    log: Log, arm: str, impedance: ImpedanceConfig, samples: Array, *, true: bool = False
) -> float:
    """Returns ‖μ − μ_E‖ / ‖μ‖ of the means, with the family's elastic moment μ_E: zero at rest.

    With `true`, that of the true E, see `force_spring_error`.
    """
    elastic = [
        family.elastic_moment_W(D, F)
        for family, D, F in _attitudes(log, arm, impedance, samples, true=true)
    ]
    return _relative_error(_wrench(log, arm, true)[samples, :3], np.array(elastic))


def _relative_error(wrench: Array, spring: Array) -> float:
    mean = wrench.mean(axis=0)
    return float(np.linalg.norm(mean - spring.mean(axis=0)) / np.linalg.norm(mean))


def _followed(log: Log, arm: str, true: bool) -> Array:
    return true_motion(log, arm) if true else log[f"{arm}/motion_C"]


def _wrench(log: Log, arm: str, true: bool) -> Array:
    return true_wrench(log, arm) if true else log[f"{arm}/wrench"]


def spring_errors(
    log: Log, arm: str, impedance: ImpedanceConfig, samples: Array, parts: Sequence[str] = PARTS
) -> dict[str, float]:
    """Returns `force_spring_error` and `moment_spring_error` for `spring_claims`, by name."""
    errors = {"force": force_spring_error, "moment": moment_spring_error}
    return {
        f"{kind}{part}": errors[part](log, arm, impedance, samples, true=bool(kind))
        for part in parts
        for kind in ("", _TRUE)
    }


def spring_claims(values: Mapping[str, float], bounds: Mapping[str, float]) -> list[Claim]:
    """Returns the claims that the wrench is that of the springs, for C and for the true E.

    Args:
        values: `spring_errors`, as far as they exist.
        bounds: of `force` and, if it is claimed, of `moment`.
    """
    of_C = [blind(at_most(_WORDS[part], values.get(part), bounds[part])) for part in bounds]
    of_E = [
        at_most(_WORDS[_TRUE + part], values.get(_TRUE + part), bounds[part]) for part in bounds
    ]
    return of_C + of_E


def quaternion_error(log: Log, arm: str, frame: str) -> Array:
    """Returns ε of the orientation of D seen from `frame` (C or E) over time (N×3)."""
    D, F = (log[f"{arm}/motion_{name}"][:, QUATERNION] for name in ("D", frame))
    return np.array([quaternion.relative(Q_WF, Q_WD)[1:] for Q_WF, Q_WD in zip(F, D, strict=True)])


def position_offset(log: Log, arm: str) -> Array:
    """Returns Δp_de, D from the true E, over time in W (N×3) [mm]."""
    return 1e3 * (log[f"{arm}/motion_D"] - true_motion(log, arm))[:, POSITION]


def orientation_angle(log: Log, arm: str) -> Array:
    """Returns the angle between D and the true E over time (N) [°]."""
    half = np.linalg.norm(quaternion_error(log, arm, "E"), axis=1)
    return np.asarray(np.degrees(2.0 * np.arcsin(np.minimum(half, 1.0))))


def misalignment(epsilon: Array, axis: Array) -> Array:
    """Returns δ = ‖S(ε) u‖ over time (N), u the unit vector along `axis`."""
    return np.linalg.norm(epsilon @ so3.skew(np.asarray(axis) / np.linalg.norm(axis)), axis=1)


def _attitudes(
    log: Log,
    arm: str,
    impedance: ImpedanceConfig,
    samples: Array | slice = slice(None),
    *,
    true: bool = False,
) -> list[tuple[OrientationImpedance, Array, Array]]:
    """Returns the family with the quaternions of D and C, or of the true E, sample by sample."""
    family = impedance.make_rotation()
    D, F = log[f"{arm}/motion_D"], _followed(log, arm, true)
    D, F = (motion[samples][:, QUATERNION] for motion in (D, F))
    return [(family, Q_WD, Q_WF) for Q_WD, Q_WF in zip(D, F, strict=True)]
