"""Distance from the joint limits."""

from collections.abc import Sequence

import numpy as np

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.task_functions.task_function import Instant, TaskValue, joint_index
from geoimp_drake.validation import unknown_name

__all__ = ["JointLimitDistance"]


class JointLimitDistance:
    """w = −½ Σ z_i², z_i = max(0, |x_i| − 1 + m)/m; climb it (k_β > 0).

    x_i is the joint's position, −1 and 1 at its limits. Only the outermost fraction m of each half
    range counts. With m = 1 all of it counts, and w is the usual quadratic distance from mid-range.
    With a small m the arm is free until it comes near a limit. The gradient is continuous. Joints
    without finite limits do not count.

    Args:
        model: the arm.
        joints: names of the joints that count; all by default.
        margin: m, between 0 and 1.

    Raises:
        ConfigurationError: a joint is unknown or has no limits (the message lists the valid ones),
            or the margin cannot be used.
    """

    def __init__(self, model: ControlModel, joints: Sequence[str] = (), margin: float = 0.2):
        if not 0.0 < margin <= 1.0:
            raise ConfigurationError(
                f"joint limits: margin is {margin:g}; it must be above 0 and at most 1."
            )
        lower, upper = model.plant.GetPositionLowerLimits(), model.plant.GetPositionUpperLimits()
        limited = [
            name for k, name in enumerate(model.joint_names) if np.isfinite(upper[k] - lower[k])
        ]
        for name in joints or limited:
            if name not in limited:
                raise unknown_name(name, "joint with limits", limited)
        self._index = np.array([joint_index(model, name) for name in joints or limited], dtype=int)
        self._margin = margin
        self._middle = 0.5 * (lower + upper)[self._index]
        self._half = 0.5 * (upper - lower)[self._index]

    def evaluate(self, instant: Instant) -> TaskValue:
        """Returns w and its derivatives."""
        i, unit = self._index, 1.0 / (self._half * self._margin)
        x = (instant.q[i] - self._middle) / self._half
        near = np.abs(x) > 1.0 - self._margin
        z = near * np.copysign(np.abs(x) - 1.0 + self._margin, x) / self._margin
        dz = near * instant.v[i] * unit
        gradient, gradient_rate = np.zeros((2, len(instant.q)))
        gradient[i] = -z * unit
        gradient_rate[i] = -dz * unit
        return TaskValue(-0.5 * float(z @ z), -float(z @ dz), gradient, gradient_rate)
