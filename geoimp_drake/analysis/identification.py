"""The impedance that a log shows: M, D and K by least squares, each with its confidence.

The laws (3.1) and those of the orientation families are linear in their gains. So one linear
regression of the logged wrench on the logged motion finds the gains. On C it tells whether the
controller computed what was asked for; on E, whether the arm does it.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from geoimp_drake.analysis.least_squares import BLOCK, fitted
from geoimp_drake.controllers.impedance_config import ImpedanceConfig
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.frame_motion import (
    ACCELERATION,
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
    VELOCITY,
)
from geoimp_drake.laws.impedance.coupled_stiffness import without_coupling
from geoimp_drake.laws.impedance.families import OrientationImpedance, make_family
from geoimp_drake.rotations.quaternion import to_rotation
from geoimp_drake.typing import Array

__all__ = ["FRAMES", "Estimate", "Reading", "identify", "moving"]

FRAMES = ("C", "E")
GAINS = ("mass", "damping", "stiffness")

# A number does not count if its interval is wider than half of it.
_WIDEST = 0.5
# Length of the Hann window that filters motion and wrench of E alike [s].
_WINDOW = 0.2
# The least number of blocks in a log.
_BLOCKS = 3


@dataclass(frozen=True)
class Estimate:
    """One gain along one axis: the configured and the identified value.

    Attributes:
        part: translation or rotation.
        gain: mass, damping or stiffness.
        axis: x, y or z, or the number of a principal axis of a gain that is not diagonal.
        direction: the axis as a unit vector (3,), in the axes of the gain.
        asked: the configured value, in SI units.
        found: the identified value; None where the motion does not excite it enough.
        half_width: of the 95 % interval about that value; infinite if nothing is excited.
    """

    part: str
    gain: str
    axis: str
    direction: tuple[float, ...]
    asked: float
    found: float | None
    half_width: float

    @property
    def error(self) -> float | None:
        """(found − asked)/asked; None where nothing is found."""
        return None if self.found is None else self.found / self.asked - 1.0


@dataclass(frozen=True)
class Reading:
    """One part of the impedance as a log shows it.

    Attributes:
        part: translation or rotation.
        frame: C or E, the one whose motion was used.
        estimates: of mass, damping and stiffness along three axes each.
        condition: of the regression with columns of length 1. It is large where gains cannot be
            told from each other, and infinite where one is not excited at all.
        misfit: the unexplained part of the wrench, relative to the wrench (rms).
    """

    part: str
    frame: str
    estimates: tuple[Estimate, ...]
    condition: float
    misfit: float

    @property
    def mean_error(self) -> float | None:
        """The mean size of the relative errors of all identified gains; None if there are none."""
        errors = [abs(e.error) for e in self.estimates if e.error is not None]
        return float(np.mean(errors)) if errors else None


def identify(
    log: Mapping[str, Array], impedance: ImpedanceConfig, hand: str = "six", frame: str = "C"
) -> list[Reading]:
    """Returns the impedance that a log shows, in translation and rotation where it is compliant.

    Each gain is assumed to have its configured axes, which leaves three numbers. On E accelerations
    are differences, and motion and wrench pass through the same window of 0.2 s.

    Args:
        log: of a run, with `hand`'s motion_D, motion_C or motion_E, and wrench.
        impedance: the configured one: its family, axes, and values for comparison.
        hand: `six` or `seven`; `object` for the object that two arms hold.
        frame: C or E.

    Raises:
        ConfigurationError: a key is missing or cannot be used, or the log is too short.
    """
    moved = "O" if hand == "object" and frame == "E" else frame
    t = _times(log)
    D, X, h = (
        _signal(log, f"{hand}/{key}", (len(t), size))
        for key, size in (("motion_D", 19), (f"motion_{moved}", 19), ("wrench", 6))
    )
    window = _hann(t) if frame == "E" else np.ones(1)
    if len(t) < (least := len(window) + BLOCK * _BLOCKS):
        raise ConfigurationError(
            f"The log has {len(t)} samples; the impedance of {frame} needs {least}. Run "
            f"longer, or with a smaller log_period."
        )
    if frame == "E":
        X = X.copy()
        X[:, ACCELERATION] = np.gradient(X[:, VELOCITY], t, axis=0)
    h = _without_coupling(D, X, h, impedance)
    regressions = {"translation": _translation, "rotation": _rotation}
    return [
        _reading(impedance, part, frame, *_smoothed(window, *regressions[part](impedance, D, X, h)))
        for part in regressions
        if impedance.axes in ("both", part)
    ]


def moving(log: Mapping[str, Array]) -> list[str]:
    """Returns the bodies whose impedance a log has: the names before motion_D.

    Raises:
        ConfigurationError: there are none.
    """
    hands = [key.removesuffix("/motion_D") for key in log if key.endswith("/motion_D")]
    if not hands:
        raise ConfigurationError(
            f"The log has no desired motion '…/motion_D', and shows no impedance; it has: "
            f"{', '.join(log)}."
        )
    return hands


def _times(log: Mapping[str, Array]) -> Array:
    t = np.asarray(log.get("t", ()))
    if t.ndim != 1 or len(t) < 2 or not np.all(np.diff(t) > 0.0):
        raise ConfigurationError("The log's times 't' must be at least two, in ascending order.")
    return t


def _signal(log: Mapping[str, Array], key: str, shape: tuple[int, int]) -> Array:
    if key not in log:
        raise ConfigurationError(
            f"The log has no {key!r}, from which the impedance is read; it has: {', '.join(log)}."
        )
    if log[key].shape != shape or not np.all(np.isfinite(log[key])):
        raise ConfigurationError(
            f"{key!r} of the log has shape {log[key].shape}, to be {shape} and finite throughout."
        )
    return np.asarray(log[key])


def _hann(t: Array) -> Array:
    """Returns a window of weights with the sum 1."""
    period = (t[-1] - t[0]) / (len(t) - 1)
    weights = np.hanning(2 * max(round(0.5 * _WINDOW / period), 1) + 3)[1:-1]
    return np.asarray(weights / weights.sum())


def _smoothed(window: Array, columns: Array, load: Array) -> tuple[Array, Array]:
    """Returns regressors (n, 3, 9) and load (n, 3), filtered by the same window."""
    both = np.concatenate((columns, load[:, :, None]), axis=2).reshape(len(load), -1)
    slow = np.stack([np.convolve(signal, window, "valid") for signal in both.T], axis=1)
    behind = slow.reshape(len(slow), 3, -1)
    return behind[:, :, :-1], behind[:, :, -1]


def _directions(gain: Array) -> tuple[Array, list[str]]:
    """Returns the principal axes of a gain as columns, and their names."""
    if np.count_nonzero(gain - np.diag(np.diag(gain))) == 0:
        return np.eye(3), ["x", "y", "z"]
    return np.linalg.eigh(gain)[1], ["1", "2", "3"]


def _along(gain: Array, signal: Array, axes: Array | None = None) -> Array:
    """Returns u uᵀ times a signal (n, 3), for each principal axis u: columns (n, 3, 3).

    `axes` (n, 3, 3) are those in which the gain is given; W's by default.
    """
    U, _ = _directions(gain)
    turned = U[None] if axes is None else axes @ U
    shares = np.einsum("nij,ni->nj", np.broadcast_to(turned, (len(signal), 3, 3)), signal)
    return turned * shares[:, None, :]


def _translation(impedance: ImpedanceConfig, D: Array, X: Array, h: Array) -> tuple[Array, Array]:
    R_WD = np.array([to_rotation(Q) for Q in D[:, QUATERNION]])
    in_desired = impedance.translation.axes == "desired"
    axes = (in_desired, in_desired, impedance.stiffness_is_in_desired())
    signals = (LINEAR_ACCELERATION, LINEAR_VELOCITY, POSITION)
    columns = [
        _along(gain, D[:, part] - X[:, part], R_WD if turns else None)
        for gain, part, turns in zip(impedance.gains("translation"), signals, axes, strict=True)
    ]
    return np.concatenate(columns, axis=2), h[:, 3:]


def _rotation(impedance: ImpedanceConfig, D: Array, X: Array, h: Array) -> tuple[Array, Array]:
    M, D_o, K = impedance.gains("rotation")
    U, _ = _directions(K)
    springs = [make_family(impedance.orientation, M, D_o, np.outer(u, u)) for u in U.T]
    free = make_family(impedance.orientation, np.eye(3), *np.zeros((2, 3, 3)))
    columns, load = [], []
    for d, x, mu in zip(D, X, h[:, :3], strict=True):
        Q = d[QUATERNION], x[QUATERNION]
        rate = free.dual_velocity(Q[0], d[ANGULAR_VELOCITY], Q[1], x[ANGULAR_VELOCITY])
        inertial, viscous = (
            _along(gain, signal[None])[0]
            for gain, signal in ((M, _dual_acceleration(free, d, x)), (D_o, rate))
        )
        elastic = np.stack([spring.elastic_moment(*Q) for spring in springs], axis=1)
        columns.append(np.concatenate((inertial, viscous, elastic), axis=1))
        load.append(free.generalized_moment(*Q, mu))
    return np.array(columns), np.array(load)


def _dual_acceleration(free: OrientationImpedance, d: Array, x: Array) -> Array:
    """Returns the derivative of the family's dual velocity (3,) [rad/s²].

    With M_o = I, without damping and stiffness, the generalized moment is that derivative; the
    family's law is affine in the moment.
    """
    state = (
        d[QUATERNION],
        d[ANGULAR_VELOCITY],
        d[ANGULAR_ACCELERATION],
        x[QUATERNION],
        x[ANGULAR_VELOCITY],
    )
    without = free.angular_acceleration(*state, np.zeros(3))
    by_moment = np.stack(
        [free.angular_acceleration(*state, mu) - without for mu in np.eye(3)], axis=1
    )
    mu_W = np.linalg.solve(by_moment, x[ANGULAR_ACCELERATION] - without)
    return free.generalized_moment(d[QUATERNION], x[QUATERNION], mu_W)


def _without_coupling(D: Array, X: Array, h: Array, impedance: ImpedanceConfig) -> Array:
    """Returns the wrench without the part of a coupling K_c, which is assumed as configured."""
    if impedance.coupling is None:
        return h
    K_p, K_c = impedance.gains("translation")[2], impedance.coupling
    loads = [
        without_coupling(
            d[QUATERNION],
            x[QUATERNION],
            d[POSITION] - x[POSITION],
            wrench[:3],
            wrench[3:],
            K_p,
            K_c,
        )[:2]
        for d, x, wrench in zip(D, X, h, strict=True)
    ]
    return np.array([np.concatenate(load) for load in loads])


def _reading(
    impedance: ImpedanceConfig, part: str, frame: str, columns: Array, load: Array
) -> Reading:
    values, half_widths, condition, left = fitted(columns, load)
    gains = zip(GAINS, impedance.gains(part), strict=True)
    rows = [
        (name, axis, u, u @ gain @ u)
        for name, gain in gains
        for u, axis in zip(_directions(gain)[0].T, _directions(gain)[1], strict=True)
    ]
    estimates = tuple(
        Estimate(
            part,
            name,
            axis,
            tuple(u.tolist()),
            float(asked),
            float(value) if 2.0 * half_width <= _WIDEST * abs(value) else None,
            float(half_width),
        )
        for (name, axis, u, asked), value, half_width in zip(rows, values, half_widths, strict=True)
    )
    return Reading(part, frame, estimates, condition, left)
