"""What the experiments measure in a log; nothing here judges or draws.

`arm` is the name under which motions and wrench are logged: of an arm, or `object`.
"""

from collections.abc import Sequence

import numpy as np

from geoimp_drake.controllers.impedance_config import ImpedanceConfig
from geoimp_drake.laws.impedance.orientation_impedance import OrientationImpedance
from geoimp_drake.laws.impedance.translational_impedance import turned
from geoimp_drake.rotations import quaternion, so3
from geoimp_drake.simulation.claims import phase_reached
from geoimp_drake.systems.frame_motion import POSITION, QUATERNION
from geoimp_drake.systems.sources.desired_motion import MotionSegment, length_of
from geoimp_drake.typing import Array

__all__ = [
    "ORIENTATION_LABELS",
    "Log",
    "conditioning",
    "end_reached",
    "ended_in_contact",
    "force_spring_error",
    "misalignment",
    "moment_spring_error",
    "orientation_displacement",
    "quaternion_error",
    "spring_force",
]

Log = dict[str, Array]

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
    """Returns whether the run went on to the end of its motion."""
    return phase_reached(log, length_of(segments))


def ended_in_contact(log: Log, segments: Sequence[MotionSegment]) -> bool:
    """Returns whether the motion has ended, with a surface there to press on."""
    return "surface/plane" in log and end_reached(log, segments)


def orientation_displacement(log: Log, arm: str, impedance: ImpedanceConfig) -> Array:
    """Returns the displacement of C from D in the family's own coordinates over time (N×3)."""
    return np.array([family.displacement(D, C) for family, D, C in _attitudes(log, arm, impedance)])


def conditioning(log: Log, arm: str, impedance: ImpedanceConfig) -> Array:
    """Returns cond(T) of the family's Euler angles over time (N); one for other families."""
    return np.array([family.conditioning(D, C) for family, D, C in _attitudes(log, arm, impedance)])


def spring_force(log: Log, arm: str, impedance: ImpedanceConfig, samples: Array) -> Array:
    """Returns K_p Δp_dc in W over some samples (N×3) [N]."""
    D, C = (log[f"{arm}/motion_{frame}"][samples] for frame in "DC")
    _, _, K_p = impedance.gains("translation")
    displacement = D[:, POSITION] - C[:, POSITION]
    if not impedance.stiffness_is_in_desired():
        return displacement @ K_p.T
    attitudes = map(quaternion.to_rotation, D[:, QUATERNION])
    return np.array(
        [turned(K_p, R_WD) @ dp for R_WD, dp in zip(attitudes, displacement, strict=True)]
    )


def force_spring_error(log: Log, arm: str, impedance: ImpedanceConfig, samples: Array) -> float:
    """Returns the largest ‖f − K_pΔp_dc‖ / ‖f‖ over some samples: (3.1) at rest."""
    force = log[f"{arm}/wrench"][samples, 3:]
    error = np.linalg.norm(force - spring_force(log, arm, impedance, samples), axis=1)
    return float((error / np.linalg.norm(force, axis=1)).max())


def moment_spring_error(log: Log, arm: str, impedance: ImpedanceConfig, samples: Array) -> float:
    """Returns the largest ‖μ − μ_E‖ / ‖μ‖, μ_E the family's elastic moment: at rest zero."""
    moment = log[f"{arm}/wrench"][samples, :3]
    elastic = [
        family.elastic_moment_W(D, C) for family, D, C in _attitudes(log, arm, impedance, samples)
    ]
    error = np.linalg.norm(moment - np.array(elastic), axis=1)
    return float((error / np.linalg.norm(moment, axis=1)).max())


def quaternion_error(log: Log, arm: str, frame: str) -> Array:
    """Returns ε of the orientation of D seen from `frame` (C or E) over time (N×3)."""
    D, F = (log[f"{arm}/motion_{name}"][:, QUATERNION] for name in ("D", frame))
    return np.array([quaternion.relative(Q_WF, Q_WD)[1:] for Q_WF, Q_WD in zip(F, D, strict=True)])


def misalignment(epsilon: Array, axis: Array) -> Array:
    """Returns δ = ‖S(ε) u‖ over time (N), u the unit vector along `axis`."""
    return np.linalg.norm(epsilon @ so3.skew(np.asarray(axis) / np.linalg.norm(axis)), axis=1)


def _attitudes(
    log: Log, arm: str, impedance: ImpedanceConfig, samples: Array | slice = slice(None)
) -> list[tuple[OrientationImpedance, Array, Array]]:
    """Returns the family with the quaternions of D and C, sample by sample."""
    family = impedance.make_rotation()
    D, C = (log[f"{arm}/motion_{frame}"][samples][:, QUATERNION] for frame in "DC")
    return [(family, Q_WD, Q_WC) for Q_WD, Q_WC in zip(D, C, strict=True)]
