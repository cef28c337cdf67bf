"""Gains, weight and task function of a redundant arm's null-space motion, (3.33), (3.36)-(3.39)."""

from collections.abc import Callable
from math import isnan

import numpy as np

from geoimp_drake.arm.control_model import TASK_DIMENSION, ControlModel
from geoimp_drake.arm.dynamics import Scratch
from geoimp_drake.arm.state import ArmState
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import SingularityDamping
from geoimp_drake.parts.null_space_gain import GainWatch, null_space_gain
from geoimp_drake.parts.part import Memory
from geoimp_drake.task_functions.task_function import Instant, NoTask, TaskFunction, TaskValue
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, spd_matrix

__all__ = ["NullSpace"]


class NullSpace:
    """How the null-space motion is controlled, and what is remembered of it.

    It remembers the posture at the start, from which targets of the task function may start. The
    posture is NaN until it has been kept. It also remembers whether it has warned of K_n.

    Args:
        model: the arm.
        K_n: constant gain of e_n, symmetric positive definite (n×n), or a number k for k I
            [Nms/rad, Ns/m]; zero for κB.
        kappa: rate κ at which e_n decays by the gain κB [1/s]; `DEFAULT_KAPPA` without K_n.
        k_beta: gain k_β of the task function (3.39); positive climbs w, negative descends.
        task: the task function w; none by default.
        weight: a constant W, symmetric positive definite (n×n); by default W = B  (3.36).
        damping: near singularities.
        period: of the joints' readings, against which a constant K_n is watched [s]; None for no
            watch.

    Attributes:
        arguments: K and κ of the gain K + κB, k_β, W and its inverse, whether W = B, σ₀ and λ₀, for
            a compiled law.
        watch: over a constant K_n; None if there is nothing to watch.

    Raises:
        ConfigurationError: K_n or the weight is not symmetric positive definite, or κ not positive.
            Or both K_n and κ are given, k_β is not finite, or the damping is negative.
    """

    def __init__(
        self,
        model: ControlModel,
        K_n: float | Array = 0.0,
        kappa: float | None = None,
        k_beta: float = 0.0,
        task: TaskFunction | None = None,
        weight: Array | None = None,
        damping: SingularityDamping | None = None,
        period: float | None = None,
    ):
        n = model.num_joints
        if not np.isfinite(k_beta):
            raise ConfigurationError(f"k_beta is {k_beta}; it must be finite.")
        damping = damping or SingularityDamping()
        check(damping, "damping")
        self._model, self._task = model, task or NoTask()
        self._is_idle = isinstance(self._task, NoTask)
        self._none = np.zeros(n)
        K, rate = null_space_gain(K_n, kappa, n)
        weights = np.zeros((2, n, n))
        if weight is not None:
            W = spd_matrix(weight, "weight", n)
            weights = np.array([W, np.linalg.inv(W)])
        limits = damping.threshold, damping.factor
        self.arguments = K, rate, float(k_beta), weights, weight is None, *limits
        self.watch = None
        if K.any() and period is not None and n > TASK_DIMENSION:
            self.watch = GainWatch(K, (weights[1], weight is None, *limits), period)
        self.memory = Memory(start_posture=np.full(n, np.nan), warned=0.0)

    def keep_start(self, memory: Array, q: Array) -> None:
        """Keeps the posture at the start, if none has been kept.

        Args:
            memory: of this object.
            q: joint positions (n,).
        """
        if isnan(memory[0]):
            memory[self.memory.start_posture] = q

    def check_gain(
        self,
        memory: Array,
        bound: float,
        evaluate: Callable[[], ArmState],
        system: str,
        time: float,
    ) -> None:
        """Warns once if a constant K_n is too large at a posture.

        Args:
            memory: of this object, updated.
            bound: no rate of decay is above it, see `null_space_decay_bound` [1/s].
            evaluate: returns the arm, for a closer look.
            system: its name in the warning.
            time: [s].
        """
        watch = self.watch
        if watch is not None and bound > watch.limit and not memory[self.memory.warned]:
            memory[self.memory.warned] = watch.is_too_large(evaluate(), system, time)

    def evaluate_task(
        self,
        memory: Array,
        time: float,
        scratch: Scratch,
        x: Array,
        evaluate: Callable[[], ArmState],
    ) -> TaskValue:
        """Returns w and its derivatives.

        Args:
            memory: of this object.
            time: [s].
            scratch: of the model.
            x: [q; v] (2n,) in the model's order.
            evaluate: returns the arm, for a task function that uses it.
        """
        n = len(self._none)
        if self._is_idle:
            return TaskValue(0.0, 0.0, self._none, self._none)
        instant = Instant(
            time,
            x[:n],
            x[n:],
            x[:n] if isnan(memory[0]) else memory[self.memory.start_posture],
            evaluate,
            lambda: scratch.at(x),
        )
        return self._task.evaluate(instant)
