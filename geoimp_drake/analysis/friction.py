"""Friction of each joint, from a logged motion."""

from dataclasses import dataclass

import numpy as np

from geoimp_drake.analysis.least_squares import BLOCK, fitted
from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.simulation.log_data import joint_columns
from geoimp_drake.typing import Array

__all__ = ["JointFriction", "friction_from_log"]

# Rows over which momentum and torques are balanced; velocity below which a joint may stick.
_WINDOW, _SLOW = 5, 0.02  # [rad/s, m/s]

# A number does not count if its interval is wider than half of it.
_WIDEST = 0.5


@dataclass(frozen=True)
class JointFriction:
    """The friction of one joint that a log shows.

    Attributes:
        name: of the joint.
        coulomb: Coulomb friction [Nm, N]; None where the motion does not show it.
        viscous: viscous friction beyond the model's [Nms/rad, Ns/m]; None in the same case.
        half_widths: of their 95 % intervals; infinite where the motion shows nothing.
    """

    name: str
    coulomb: float | None
    viscous: float | None
    half_widths: tuple[float, float]


def friction_from_log(
    log: dict[str, Array], arm: str, model: ControlModel
) -> tuple[JointFriction, ...]:
    """(R.4) Returns Coulomb and viscous friction of each joint, beyond the model's.

    While a joint moves in one direction, its momentum gains the torques' impulse less friction:

        Δp = ∫ (τ + Ḃq̇ − Cq̇ − Fq̇ − g − Jᵀh) dt − F_c ∫ sgn q̇ dt − F_v ∫ q̇ dt − b Δt

    This is linear in F_c, F_v and a bias b, which takes up an error of the weight. Joints have to
    move in both directions, at several speeds.

    Args:
        log: arrays of a run or a drive, by key.
        arm: the arm's name in the log.
        model: the arm; without weight if the robot itself held it.

    Raises:
        ConfigurationError: the log is not of this arm, or too short.
    """
    t, q, v, u, wrench = joint_columns(log, arm, model)
    dynamics = ChainDynamics(model)
    rows = []
    for state, tau, h in zip(np.hstack((q, v)), u, wrench, strict=True):
        at = dynamics.evaluate(None, state)
        v_now = state[model.num_joints :]
        force = tau + at.chain.dB @ v_now - at.Cv - at.Fv - at.g - at.Jv_V_WE.T @ h
        rows.append((at.B @ v_now, force))
    momentum, force = (np.array(part) for part in zip(*rows, strict=True))
    left = _means(t, force) - _gains(t, momentum)
    speeds, times = _means(t, v), np.diff(t)
    if len(left) < 3 * BLOCK or times.max() > 2.0 * times.min():
        raise ConfigurationError(
            f"The log has {len(t)} rows, or gaps in its times; friction needs {3 * BLOCK + _WINDOW}"
            f" at equal intervals. Run longer, or with a smaller log_period."
        )
    return tuple(
        _of_joint(name, v[:, k], speeds[:, k], left[:, k])
        for k, name in enumerate(model.joint_names)
    )


def _of_joint(name: str, v: Array, speed: Array, left: Array) -> JointFriction:
    windows = np.lib.stride_tricks.sliding_window_view(v, _WINDOW + 1)
    ways = np.sign(windows).sum(axis=1) / (_WINDOW + 1)
    moves = (np.abs(windows).min(axis=1) > _SLOW) & (np.abs(ways) == 1.0)
    if min((ways[moves] > 0).sum(), (ways[moves] < 0).sum()) < BLOCK:
        return JointFriction(name, None, None, (np.inf, np.inf))
    columns = np.stack((ways, speed, np.ones_like(ways)), axis=1)[moves, None, :]
    values, half_widths, *_ = fitted(columns, left[moves, None])
    coulomb, viscous = (
        float(value) if 2.0 * width <= _WIDEST * abs(value) else None
        for value, width in zip(values[:2], half_widths[:2], strict=True)
    )
    return JointFriction(name, coulomb, viscous, (float(half_widths[0]), float(half_widths[1])))


def _means(t: Array, values: Array) -> Array:
    """Returns the means over windows of rows, by trapezoids."""
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(t)[:, None]
    sums = np.vstack((np.zeros(values.shape[1]), np.cumsum(steps, axis=0)))
    return _gains(t, sums)


def _gains(t: Array, values: Array) -> Array:
    """Returns the increase of values over windows of rows, per time."""
    gained: Array = (values[_WINDOW:] - values[:-_WINDOW]) / (t[_WINDOW:] - t[:-_WINDOW])[:, None]
    return gained
