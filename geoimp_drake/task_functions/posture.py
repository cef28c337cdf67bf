"""The posture at the start, to which the null-space motion goes back."""

import numpy as np

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.task_functions.task_function import Instant, TaskValue
from geoimp_drake.typing import Array

__all__ = ["POSTURE_RATE", "Posture"]

# With the default κ, gravity of links 10 % heavier moves a posture by less than 0.02 rad [1/s].
POSTURE_RATE = 30.0


class Posture:
    """w = ½ (q − q_0)ᵀB(q_0)(q − q_0), q_0 the posture at the start; descend it (k_β < 0).

    Scaled by the joint inertia: near q_0 (3.39) is β = k_β (q − q_0), so that −k_β is the rate at
    which the posture comes back [1/s], for an arm of any size.

    Args:
        model: the arm.
    """

    def __init__(self, model: ControlModel):
        self._plant = model.plant
        self._context = model.plant.CreateDefaultContext()
        # The last q_0 with its inertia: what follows from an argument is no state.
        self._known: tuple[Array, Array] = np.full(model.num_joints, np.nan), np.empty(0)

    def evaluate(self, instant: Instant) -> TaskValue:
        """Returns w and its derivatives; NaN for what is no posture, which others refuse."""
        if not all(map(is_finite, (instant.q, instant.v, instant.start_posture))):
            unknown = np.full_like(instant.q, np.nan)
            return TaskValue(np.nan, np.nan, unknown, unknown)
        B = self._inertia(instant.start_posture)
        e = instant.q - instant.start_posture
        gradient = B @ e
        return TaskValue(
            0.5 * float(e @ gradient), float(gradient @ instant.v), gradient, B @ instant.v
        )

    def _inertia(self, start: Array) -> Array:
        """Returns B(q_0) (n, n)."""
        if not np.array_equal(start, self._known[0]):
            self._plant.SetPositions(self._context, start)
            self._known = start.copy(), self._plant.CalcMassMatrix(self._context)
        return self._known[1]
