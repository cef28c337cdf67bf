"""From task to joint accelerations, for six joints and for more."""

from collections.abc import Callable

import numpy as np

from geoimp_drake.arm.control_model import TASK_DIMENSION, ControlModel
from geoimp_drake.arm.dynamics import ArmDynamics, ChainDynamics, DrakeDynamics, Scratch
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.laws.motion_control.resolved_acceleration import (
    check_regular,
    resolved_acceleration,
)
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import (
    singular_value_or_bound,
    smallest_singular_value,
)
from geoimp_drake.laws.redundancy.redundant_acceleration import redundant_acceleration
from geoimp_drake.parts.null_space import NullSpace
from geoimp_drake.parts.part import Memory, Now, Output
from geoimp_drake.parts.signals import check_signal
from geoimp_drake.typing import Array

__all__ = ["RedundantAcceleration", "ResolvedAcceleration", "WatchedRedundantAcceleration"]


class ResolvedAcceleration:
    """The part of `RedundancyResolver` for an arm of six joints: (2.5).

    Args:
        threshold: smallest singular value of J below which α is zero, and left to the limits.

    Raises:
        SignalError: the task acceleration is NaN or infinite.
        SingularityError: J is exactly singular, with a threshold of zero.
    """

    def __init__(self, threshold: float = 0.0) -> None:
        n = TASK_DIMENSION
        self._threshold, self._sigma = threshold, compiled(singular_value_or_bound)
        self._law, self._is_finite = compiled(resolved_acceleration), compiled(is_finite)
        self.inputs = {"task_acceleration": n, "arm": object()}
        self.memory = Memory()
        self.outputs = (
            Output("joint_acceleration", n, self._write, tuple(self.inputs)),
            Output("smallest_singular_value", 1, _write_singular_value, ("arm",)),
            Output("null_space_error", n, _write_nothing, ()),
            Output("task_value", 1, _write_nothing, ()),
        )

    def _write(self, now: Now, alpha: Array) -> None:
        arm, a = now["arm"], _task_acceleration(now, self._is_finite)
        if self._sigma(arm.Jv_V_WE, self._threshold) < self._threshold:
            alpha[:] = 0.0
            return
        try:
            alpha[:] = self._law(arm.Jv_V_WE, arm.Jdot_v, a)
        except np.linalg.LinAlgError:
            check_regular(arm.Jv_V_WE)
            raise


class RedundantAcceleration:
    """The part of `RedundancyResolver` for an arm of more than six joints: (3.32)-(3.39).

    Args:
        model: the arm.
        null_space: how its null-space motion is controlled.
    """

    def __init__(self, model: ControlModel, null_space: NullSpace):
        n = model.num_joints
        self._model, self._null_space = model, null_space
        self._chain, self._drake = ChainDynamics(model), DrakeDynamics(model)
        self._law, self._is_finite = compiled(redundant_acceleration), compiled(is_finite)
        self.inputs = {"task_acceleration": TASK_DIMENSION, "arm": object()}
        self.memory = null_space.memory
        posture = "memory", "arm", "time"
        self.outputs = (
            Output("joint_acceleration", n, self._write, (*posture, "task_acceleration")),
            Output("smallest_singular_value", 1, _write_singular_value, ("arm",)),
            Output("null_space_error", n, self._write_error, posture),
            Output("task_value", 1, self._write_task_value, posture),
        )

    def settle(self, memory: Array, now: Now) -> None:
        """Keeps the posture at the start: the joints have been read."""
        self._null_space.keep_start(memory, now["arm"].q)

    def new_workspace(self) -> Scratch:
        """Returns a context of the model's plant."""
        return Scratch(self._model)

    def _evaluate(self, now: Now) -> tuple[float, Array, Array, Array, float]:
        """Returns w, J†, α_n, e_n and `null_space_decay_bound`."""
        arm, null_space = now["arm"], self._null_space
        x = np.concatenate((arm.q, arm.v))
        task = null_space.evaluate_task(now.memory, now.time, now.workspace, x, lambda: arm)
        gradients = task.gradient, task.gradient_rate
        dynamics: ArmDynamics = self._drake if arm.chain is None else self._chain
        terms = dynamics.null_space(now.workspace, arm, gradients, null_space.arguments)
        return task.value, *terms

    def _write(self, now: Now, alpha: Array) -> None:
        a = _task_acceleration(now, self._is_finite)
        _, J_pinv, alpha_n, *_ = self._evaluate(now)
        alpha[:] = self._law(J_pinv, a, now["arm"].Jdot_v, alpha_n)

    def _write_error(self, now: Now, error: Array) -> None:
        *_, error[:], _ = self._evaluate(now)

    def _write_task_value(self, now: Now, value: Array) -> None:
        value[:], *_ = self._evaluate(now)


class WatchedRedundantAcceleration(RedundantAcceleration):
    """The same with a constant K_n, which each step compares with the largest for the posture."""

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Warns once of a K_n that is too large."""
        if self._null_space.watch is not None:
            arm = now["arm"]
            bound = self._null_space.watch.bound(arm)
            self._null_space.check_gain(memory, bound, lambda: arm, now.system, now.time)


def _task_acceleration(now: Now, is_finite: Callable[[Array], bool]) -> Array:
    a: Array = now["task_acceleration"]
    if not is_finite(a):
        check_signal(a, now.port("task_acceleration"))
    return a


def _write_singular_value(now: Now, value: Array) -> None:
    value[:] = smallest_singular_value(now["arm"].Jv_V_WE)


def _write_nothing(now: Now, value: Array) -> None:
    value[:] = 0.0
