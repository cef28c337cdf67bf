"""The agreement of MuJoCo and Drake on the same experiment: one curve a simulator, and bounds.

Runs are compared in pairs, `drake` with `mujoco`, `drake NAME` with `mujoco NAME`. Two values
depend on how a simulator divides the contact: the sideways force that friction leaves, and the peak
moment as the disk's edge arrives. Nothing is claimed about them.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from geoimp_drake.diagrams.experiments.comparisons import COMPARISONS, Comparison, Runs
from geoimp_drake.diagrams.experiments.consistency import largest_misalignment
from geoimp_drake.diagrams.experiments.measures import (
    Log,
    ended_in_contact,
    quaternion_error,
    true_wrench,
)
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.rotations import quaternion
from geoimp_drake.simulation.claims import Claim, at_most, last_second, normal_stiffness
from geoimp_drake.systems.frame_motion import QUATERNION
from geoimp_drake.typing import Array

__all__ = ["SIMULATORS"]

_DRAKE, _MUJOCO = "drake", "mujoco"


def _pairs(runs: Runs) -> Iterator[tuple[str, tuple[Log, Any], tuple[Log, Any]]]:
    """Yields, for each pair, the suffix of a claim's name, and both runs."""
    for name, run in runs.items():
        other = name.replace(_DRAKE, _MUJOCO)
        if name.startswith(_DRAKE) and other in runs:
            yield name.removeprefix(_DRAKE).replace(" ", ", ", 1), run, runs[other]


def _contact_agrees(runs: Runs) -> list[Claim]:
    claims = []
    for which, drake, mujoco in _pairs(runs):
        peaks = [float(_norms(*run).max()) for run in (drake, mujoco)]
        values = _at_rest(drake, mujoco)
        for words, name, bound, unit in (
            ("normal stiffness, relative", "stiffness", 0.01, ""),
            ("force at rest, relative", "force", 0.005, ""),
            ("moment at rest, relative", "moment", 0.02, ""),
            ("attitude of E at rest", "attitude", 0.3, "°"),
        ):
            claims.append(at_most(f"off Drake: {words}{which}", values.get(name), bound, unit))
        claims.append(at_most(f"off Drake: peak force, relative{which}", _off(*peaks), 0.03))
    return claims


def _at_rest(*runs: tuple[Log, SingleArmScenario]) -> dict[str, float | None]:
    """Returns the differences of two runs at rest, None where one of them has not come to rest."""
    if not all(ended_in_contact(log, scenario.segments) for log, scenario in runs):
        return {}
    arm = runs[0][1].arm
    rests = [last_second(log) for log, _ in runs]
    logs = [log for log, _ in runs]
    stiffnesses = [normal_stiffness(log, arm, rest) for log, rest in zip(logs, rests, strict=True)]
    h = [true_wrench(log, arm)[rest].mean(axis=0) for log, rest in zip(logs, rests, strict=True)]
    Q = [log[f"{arm}/motion_E"][-1, QUATERNION] for log in logs]
    angle = 2.0 * np.arcsin(min(1.0, float(np.linalg.norm(quaternion.relative(*Q)[1:]))))
    moments, forces = ([float(np.linalg.norm(one[k : k + 3])) for one in h] for k in (0, 3))
    return {
        "stiffness": _off(*stiffnesses),
        "force": _off(*forces),
        "moment": _off(*moments),
        "attitude": float(np.rad2deg(angle)),
    }


def _norms(log: Log, scenario: SingleArmScenario) -> Array:
    norms: Array = np.linalg.norm(true_wrench(log, scenario.arm)[:, 3:], axis=1)
    return norms


def _off(drake: float, mujoco: float) -> float | None:
    """Returns the relative difference; None where the reference is zero."""
    return abs(float(mujoco / drake) - 1.0) if drake else None


def _turning_agrees(runs: Runs) -> list[Claim]:
    claims = []
    for which, drake, mujoco in _pairs(runs):
        deltas = [largest_misalignment(*run, "E") for run in (drake, mujoco)]
        errors = [quaternion_error(log, scenario.arm, "E") for log, scenario in (drake, mujoco)]
        n = min(map(len, errors))
        turned = float(np.abs(errors[1][:n] - errors[0][:n]).max())
        claims += [
            at_most(f"off Drake: ᵉε_de at any time{which}", turned, 2e-3),
            at_most(f"off Drake: largest δ{which}", abs(deltas[1] - deltas[0]), 1e-3),
        ]
    return claims


# By experiment.
SIMULATORS = {
    "plexiglas": Comparison(COMPARISONS["plexiglas"].curves, _contact_agrees),
    "consistency": Comparison(COMPARISONS["consistency"].curves, _turning_agrees),
    "nondiagonal": Comparison(COMPARISONS["nondiagonal"].curves, _turning_agrees),
}
