"""The posture at the start, to which the null-space motion returns."""

import numpy as np

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.compilation.compiled import bound
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.laws.redundancy.kept_posture import kept_posture
from geoimp_drake.task_functions.task_function import Instant, TaskValue
from geoimp_drake.typing import Array

__all__ = ["POSTURE_RATE", "Posture"]

# With the default κ, links that are 10 % heavier move a posture by less than 0.02 rad [1/s].
POSTURE_RATE = 30.0


class Posture:
    """w = ½ (q − q_0)ᵀB(q_0)(q − q_0), q_0 the posture at the start; descend it (k_β < 0).

    The joint inertia scales it: near q_0 (3.39) is β = k_β (q − q_0). So −k_β is the rate at which
    the posture returns [1/s], for an arm of any size.

    Args:
        model: the arm.
    """

    def __init__(self, model: ControlModel):
        self._plant = model.plant
        self._context = model.plant.CreateDefaultContext()
        n = model.num_joints
        # The last q_0 with its inertia. It follows from an argument, and so is no state.
        self._start, self._inertia = np.full(n, np.nan), np.zeros((n, n))
        self._known = b""
        self._x, self._gradients = np.zeros(2 * n), np.zeros((2, n))
        self._law = bound(kept_posture, self._inertia, self._start, self._x, self._gradients)

    def evaluate(self, instant: Instant) -> TaskValue:
        """Returns w and its derivatives; NaN for a posture with NaN, which others refuse."""
        n = len(instant.q)
        self._take(instant.start_posture)
        self._x[:n], self._x[n:] = instant.q, instant.v
        value, rate = self._law()
        gradient, gradient_rate = self._gradients.copy()
        return TaskValue(value, rate, gradient, gradient_rate)

    def _take(self, start: Array) -> None:
        """Finds B(q_0) (n, n) of another q_0."""
        known = start.tobytes()
        if known != self._known:
            self._known, self._start[:] = known, start
            if is_finite(start):
                self._plant.SetPositions(self._context, start)
                self._inertia[:] = self._plant.CalcMassMatrix(self._context)
