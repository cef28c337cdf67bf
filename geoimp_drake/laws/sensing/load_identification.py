"""The load on a wrist sensor and the sensor's bias, identified from postures or from a motion.

A reading is linear in the sixteen numbers of the load and of a constant bias b. They are mass m,
first moment m c, inertia I about the sensor's origin, and b. With the acceleration a of that
origin, in the sensor's axes,

    f = m (a − g) + ω̇ × m c + ω × (ω × m c) + b_f,   μ = m c × (a − g) + I ω̇ + ω × I ω + b_μ,

which is `sensed_wrench.load_of_tool` with the inertia about the sensor's origin, plus the bias.
Least squares give the numbers. The joints of an arm also show a load at its end effector: they feel
τ_ext = −Jᵀ[μ; f] + b, with a bias b of each. Floats only.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.rotations.so3 import skew
from geoimp_drake.typing import Array

__all__ = [
    "WORST_CONDITION",
    "IdentifiedLoad",
    "identify_load",
    "identify_load_from_joints",
    "load_regressor",
]

# Beyond this condition number the postures are too alike. Six postures tilted by 15° have 11,
# tilted by 5° they have 32.
WORST_CONDITION = 20.0

_STATIC = [0, 1, 2, 3, *range(10, 16)]
_REST = (np.zeros(3),) * 3


@dataclass(frozen=True)
class IdentifiedLoad:
    """What a sensor carries.

    Attributes:
        mass: [kg].
        centre_of_mass: c in S (3) [m].
        bias: the reading without any load, [moment; force] in S (6) [Nm, N], or of the joints (n).
        inertia: about the centre of mass, in S (3, 3) [kg m²]; zero if there was no motion.
        condition: number of the least squares, with columns of unit norm.
        left_over: largest |moment| and |force| that load and bias do not explain [Nm, N], or
            largest torque of a joint.
    """

    mass: float
    centre_of_mass: Array
    bias: Array
    inertia: Array
    condition: float
    left_over: tuple[float, ...]


def load_regressor(R_WS: Array, w: Array, dw: Array, a: Array, gravity: Array) -> Array:
    """Returns Y (6, 16): the reading [moment; force] is Y times the sixteen numbers.

    They are m, m c, I_xx, I_yy, I_zz, I_xy, I_xz, I_yz and b.

    Args:
        R_WS: attitude of the sensor (3, 3).
        w: its angular velocity, in W (3) [rad/s].
        dw: its angular acceleration, in W (3) [rad/s²].
        a: acceleration of its origin, in W (3) [m/s²].
        gravity: g in W (3) [m/s²].
    """
    w_S, dw_S, specific = R_WS.T @ w, R_WS.T @ dw, R_WS.T @ (a - gravity)
    spin = skew(w_S)
    moment = np.hstack((np.zeros((3, 1)), -skew(specific), _inertia(dw_S) + spin @ _inertia(w_S)))
    force = np.hstack((specific[:, None], skew(dw_S) + spin @ spin, np.zeros((3, 6))))
    return np.hstack((np.vstack((moment, force)), np.eye(6)))


def identify_load(
    readings: Sequence[Array],
    attitudes: Sequence[Array],
    gravity: Array,
    motions: Sequence[tuple[Array, Array, Array]] | None = None,
) -> IdentifiedLoad:
    """Returns load and bias of a wrist sensor.

    Args:
        readings: [moment; force] in S (6), one for each posture (the mean of some time at rest) or
            instant of a motion.
        attitudes: R_WS (3, 3) of each; six postures tilted by 60° in different directions are good.
        gravity: g in W (3) [m/s²].
        motions: (ω, ω̇, a) of the sensor's origin in W at each instant; at rest by default.

    Raises:
        ConfigurationError: the numbers of readings, attitudes and motions differ or are zero. Or
            the postures are too alike to tell a load from a bias, with the condition number.
    """
    _check_numbers(readings=readings, attitudes=attitudes, motions=motions)
    moved = motions or [_REST] * len(readings)
    each = zip(attitudes, moved, strict=True)
    columns = slice(None) if motions else _STATIC
    Y = np.vstack([load_regressor(R, *motion, gravity)[:, columns] for R, motion in each])
    y = np.concatenate([np.asarray(reading, dtype=float) for reading in readings])
    advice = (
        f"Tilt the hand by 60° in six directions{', and turn it about all axes' if motions else ''}"
    )
    numbers = np.zeros(16)
    numbers[columns], condition = _least_squares(Y, y, len(readings), advice)
    rest_of = (y - Y @ numbers[columns]).reshape(-1, 2, 3)
    left = tuple(np.linalg.norm(rest_of, axis=2).max(axis=0).tolist())
    return _load(numbers, condition, left, with_inertia=motions is not None)


def identify_load_from_joints(
    torques: Sequence[Array],
    jacobians: Sequence[Array],
    attitudes: Sequence[Array],
    gravity: Array,
    motions: Sequence[tuple[Array, Array, Array]] | None = None,
) -> IdentifiedLoad:
    """Returns load and bias of an arm from external joint torques; the load is in E, not in S.

    Args:
        torques: external, on the joints, τ_ext (n), one for each posture (the mean of some time)
            or instant of a motion.
        jacobians: J (6, n) of E in W in each, [angular; linear].
        attitudes: R_WE (3, 3) in each.
        gravity: g in W (3) [m/s²].
        motions: (ω, ω̇, a) of E in W at each instant; at rest by default.

    Raises:
        ConfigurationError: the numbers of torques, Jacobians, attitudes and motions differ or are
            zero. Or the postures are too alike, with the condition number.
    """
    _check_numbers(torques=torques, Jacobians=jacobians, attitudes=attitudes, motions=motions)
    moved = motions or [_REST] * len(torques)
    each = np.eye(len(torques[0]))
    rows, size = [], 10 if motions else 4
    for J, R, motion in zip(jacobians, attitudes, moved, strict=True):
        load = load_regressor(R, *motion, gravity)[:, :size]
        rows.append(np.hstack((-J.T @ np.vstack((R @ load[:3], R @ load[3:])), each)))
    Y, y = np.vstack(rows), np.concatenate([np.asarray(tau, dtype=float) for tau in torques])
    advice = "Move the joints by 1 rad in different directions"
    numbers, condition = _least_squares(Y, y, len(torques), advice)
    left = float(np.abs(y - Y @ numbers).max())
    own = np.concatenate((numbers[:size], np.zeros(10 - size), numbers[size:]))
    return _load(own, condition, (left,), with_inertia=motions is not None)


def _check_numbers(**given: Sequence[Any] | None) -> None:
    """Raises ConfigurationError if there are not as many of each, or none."""
    counts = {name: len(values) for name, values in given.items() if values is not None}
    if len(set(counts.values())) > 1 or 0 in counts.values():
        found = ", ".join(f"{count} {name}" for name, count in counts.items())
        raise ConfigurationError(f"There are {found}; give one of each for each posture.")


def _least_squares(Y: Array, y: Array, postures: int, advice: str) -> tuple[Array, float]:
    """Returns the numbers and the condition number, with columns of Y scaled to unit norm."""
    scale = np.linalg.norm(Y, axis=0)
    condition = float(np.linalg.cond(Y / scale)) if scale.all() else np.inf
    if len(Y) < Y.shape[1] or condition > WORST_CONDITION:
        raise ConfigurationError(
            f"The {postures} postures are too alike to tell a load from a bias: the condition "
            f"number is {condition:.3g}, above {WORST_CONDITION:g}. {advice}."
        )
    return np.linalg.lstsq(Y / scale, y, rcond=None)[0] / scale, condition


def _load(
    numbers: Array, condition: float, left: tuple[float, ...], *, with_inertia: bool
) -> IdentifiedLoad:
    mass, bias = float(numbers[0]), numbers[10:]
    centre = numbers[1:4] / mass if mass else np.zeros(3)
    inertia = np.zeros((3, 3))
    if with_inertia:
        xx, yy, zz, xy, xz, yz = numbers[4:10]
        about_S = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        inertia = about_S + mass * skew(centre) @ skew(centre)
    return IdentifiedLoad(mass, centre, bias, inertia, condition, left)


def _inertia(w: Array) -> Array:
    """Returns L (3, 6) with I w = L [I_xx, I_yy, I_zz, I_xy, I_xz, I_yz]."""
    x, y, z = w
    return np.array([[x, 0, 0, y, z, 0], [0, y, 0, x, 0, z], [0, 0, z, 0, x, y]])
