"""A user's own function of time and posture."""

from collections.abc import Callable

import numpy as np

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.task_functions.task_function import Instant, TaskValue
from geoimp_drake.typing import Array

__all__ = ["UserFunction"]

_STEP = 1e-5  # of the check's central differences [rad or m]
_TOLERANCE = 1e-5  # relative: their truncation and rounding error
_HALF_STEP = 3e-5  # of the rates' central differences [s]
_CHECKS = 3


class UserFunction:
    """w(t, q), given as two callables: its value and its gradient ∂w/∂q.

    When this object is made, it compares the gradient once with central differences of the value,
    at random postures within the joint limits. Rates are central differences along the motion.

    Args:
        model: the arm; q is in its joint order, `model.joint_names`.
        value: w(t, q), a number.
        gradient: ∂w/∂q (t, q), shape (n,).

    Raises:
        ConfigurationError: the gradient has a wrong shape, or is not that of the value; the message
            names the joint and both numbers.
    """

    def __init__(
        self,
        model: ControlModel,
        value: Callable[[float, Array], float],
        gradient: Callable[[float, Array], Array],
    ):
        self._value, self._gradient = value, gradient
        for q in _postures(model):
            self._check(model, q)

    def evaluate(self, instant: Instant) -> TaskValue:
        """Returns w and its derivatives."""
        t, q = instant.time, instant.q
        dt, dq = _HALF_STEP, instant.v * _HALF_STEP
        gradient = np.asarray(self._gradient(t, q), dtype=float)
        before, after = ((t + sign * dt, q + sign * dq) for sign in (-1.0, 1.0))
        return TaskValue(
            float(self._value(t, q)),
            float(self._value(*after) - self._value(*before)) / (2.0 * dt),
            gradient,
            (np.asarray(self._gradient(*after)) - self._gradient(*before)) / (2.0 * dt),
        )

    def _check(self, model: ControlModel, q: Array) -> None:
        given = np.asarray(self._gradient(0.0, q), dtype=float)
        if given.shape != q.shape:
            raise ConfigurationError(
                f"The gradient of the task function has shape {given.shape}; it must be {q.shape}, "
                f"one entry for each of {', '.join(model.joint_names)}."
            )
        found = self._differences(q)
        error = np.abs(given - found)
        # Written so that NaN fails, too.
        if not error.max() <= _TOLERANCE * max(1.0, float(np.abs(found).max())):
            k = int(np.argmax(np.where(np.isnan(error), np.inf, error)))
            raise ConfigurationError(
                f"The gradient of the task function is wrong: for joint '{model.joint_names[k]}' "
                f"it gives {given[k]:.8g}, differences of the value give {found[k]:.8g} (at q = "
                f"{np.round(q, 4).tolist()}). Correct the gradient or the value."
            )

    def _differences(self, q: Array) -> Array:
        steps = _STEP * np.eye(len(q))
        return np.array(
            [float(self._value(0.0, q + s) - self._value(0.0, q - s)) / (2 * _STEP) for s in steps]
        )


def _postures(model: ControlModel) -> list[Array]:
    """Returns random postures well within the limits; a joint without limits gets ±π."""
    lower = np.maximum(model.plant.GetPositionLowerLimits(), -np.pi)
    upper = np.minimum(model.plant.GetPositionUpperLimits(), np.pi)
    rng = np.random.default_rng(0)
    return [
        rng.uniform(0.9 * lower + 0.1 * upper, 0.1 * lower + 0.9 * upper) for _ in range(_CHECKS)
    ]
