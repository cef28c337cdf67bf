"""Some joints follow their own fifth-order trajectory to a target."""

from collections.abc import Sequence

import numpy as np

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.redundancy.joint_target import joint_target
from geoimp_drake.task_functions.task_function import Instant, TaskValue, joint_index
from geoimp_drake.typing import Array
from geoimp_drake.validation import finite_vector, non_negative, positive

__all__ = ["JointTarget"]


class JointTarget:
    """w = ½ Σ (q_i − q_di(t))² over the chosen joints; descend it (k_β < 0).

    q_d runs from the initial to the target value along a fifth-order polynomial of time, with zero
    end velocities and accelerations. Before that, q_d is the initial value, and afterwards the
    target. By (3.39) the joints trail q_d like a first-order lag, of 1/|k_β| times an inertia.

    Args:
        model: the arm.
        joints: names of the chosen joints.
        target: end values of q_d, one each [rad or m].
        initial: where q_d begins; by default the positions when the simulation is initialized.
        start: when the trajectory begins [s].
        duration: how long it takes [s].

    Raises:
        ConfigurationError: a joint is unknown (the message lists the valid ones), a target is
            outside its joint's limits, or a number cannot be used.
    """

    def __init__(
        self,
        model: ControlModel,
        joints: Sequence[str],
        target: Array,
        *,
        initial: Array | None = None,
        start: float = 0.0,
        duration: float = 4.0,
    ):
        if not joints or len(set(joints)) < len(joints):
            raise ConfigurationError(
                f"A joint target names {list(joints) or 'no joint'}; name each joint once. "
                f"Valid: {', '.join(model.joint_names)}."
            )
        non_negative(start, "joint target: start", "s")
        positive(duration, "joint target: duration", "s")
        self._index = np.array([joint_index(model, name) for name in joints])
        self._target = self._within_limits(model, target, "target")
        self._initial: Array | None = None
        if initial is not None:
            self._initial = np.zeros(model.num_joints)
            self._initial[self._index] = self._within_limits(model, initial, "initial")
        self._law = compiled(joint_target)
        self._begin, self._duration = start, float(duration)

    def evaluate(self, instant: Instant) -> TaskValue:
        """Returns w and its derivatives."""
        gradient, gradient_rate = np.empty((2, len(instant.q)))
        start = instant.start_posture if self._initial is None else self._initial
        elapsed = instant.time - self._begin
        w, w_dot = self._law(
            instant.q,
            instant.v,
            start,
            self._index,
            self._target,
            elapsed,
            self._duration,
            gradient,
            gradient_rate,
        )
        return TaskValue(w, w_dot, gradient, gradient_rate)

    def desired(self, instant: Instant) -> tuple[Array, Array]:
        """Returns q_d and q̇_d of the chosen joints."""
        task, chosen = self.evaluate(instant), self._index
        return (instant.q - task.gradient)[chosen], (instant.v - task.gradient_rate)[chosen]

    def _within_limits(self, model: ControlModel, value: Array, field: str) -> Array:
        q = finite_vector(np.atleast_1d(value), f"joint target: {field}", len(self._index))
        lower = model.plant.GetPositionLowerLimits()[self._index]
        upper = model.plant.GetPositionUpperLimits()[self._index]
        for k in np.flatnonzero((q < lower) | (q > upper)):
            raise ConfigurationError(
                f"joint target: {field} of {model.joint_names[self._index[k]]} is {q[k]:.4f}, "
                f"outside its limits {lower[k]:.4f} to {upper[k]:.4f}."
            )
        return q
