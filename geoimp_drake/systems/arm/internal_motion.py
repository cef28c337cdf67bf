"""The internal motion of a redundant arm at one instant: (3.33) and (3.36)-(3.39) together."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from pydrake.systems.framework import Context

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.derivatives import coriolis_forces, inertia_rate
from geoimp_drake.arm.state import ArmState
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import (
    SingularityDamping,
    smallest_singular_value,
)
from geoimp_drake.laws.redundancy.internal_motion import internal_acceleration, internal_error
from geoimp_drake.laws.redundancy.null_space_acceleration import coriolis_product
from geoimp_drake.task_functions.task_function import Instant, TaskFunction
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, spd_matrix

__all__ = ["InternalMotion", "InternalMotionGains", "evaluate_internal_motion"]


@dataclass(slots=True)
class InternalMotion:
    """What (3.32) needs besides the task acceleration, and what there is to report."""

    J: Array  # (6×n)
    J_pinv: Array  # J† (n×6)
    alpha_n: Array  # (n)
    null_space_error: Array  # e_n (n)
    task_value: float  # w

    @property
    def smallest_singular_value(self) -> float:
        """That of J."""
        return smallest_singular_value(self.J)


@dataclass(slots=True)
class InternalMotionGains:
    """How the internal motion is controlled."""

    K_n: Array  # gain of e_n (n×n)
    k_beta: float  # gain of the task function
    weight: tuple[Array, Array, Array] | None  # W, W⁻¹ and Ẇ = 0; None is W = B  (3.36)
    damping: SingularityDamping
    error: Callable[..., tuple[Array, Array, Array, Array, Array]] = field(
        default_factory=lambda: compiled(internal_error)
    )
    acceleration: Callable[..., Array] = field(
        default_factory=lambda: compiled(internal_acceleration)
    )

    @staticmethod
    def checked(
        n: int,
        K_n: float | Array,
        k_beta: float,
        weight: Array | None,
        damping: SingularityDamping,
    ) -> "InternalMotionGains":
        """Returns gains for n joints; raises ConfigurationError if one cannot be used."""
        if not np.isfinite(k_beta):
            raise ConfigurationError(f"k_beta is {k_beta}; it must be finite.")
        check(damping, "damping")
        K = spd_matrix(np.asarray(K_n), "K_n", n)
        constant_weight = None if weight is None else _constant_weight(weight, n)
        return InternalMotionGains(K, float(k_beta), constant_weight, damping)


def _constant_weight(weight: Array, n: int) -> tuple[Array, Array, Array]:
    W = spd_matrix(weight, "weight", n)
    return W, np.linalg.inv(W), np.zeros((n, n))


def evaluate_internal_motion(
    model: ControlModel,
    scratch: Context,
    arm: ArmState,
    time: float,
    start_posture: Array,
    task_function: TaskFunction,
    gains: InternalMotionGains,
) -> InternalMotion:
    """Returns the internal motion's part of (3.32).

    Args:
        model: the arm.
        scratch: a context of the model's plant; it is left at the arm's posture.
        arm: the arm's state.
        time: for task functions that depend on it [s].
        start_posture: joint positions at which the motion began (n).
        task_function: w.
        gains: K_n, k_β, weight and damping.
    """
    J, v = arm.Jv_V_WE, arm.v
    dB = inertia_rate(model, scratch, arm.q, v)
    task = task_function.evaluate(
        Instant(time, arm.q, v, start_posture, lambda: arm, lambda: scratch)
    )
    # (3.33), (3.39), (3.37)
    B_inverse, J_pinv, N, beta, e_n = gains.error(
        J,
        arm.B,
        gains.weight[1] if gains.weight else np.ascontiguousarray(arm.B),
        gains.weight is None,
        gains.damping.threshold,
        gains.damping.factor,
        gains.k_beta,
        task.gradient,
        v,
    )
    W, W_inverse, dW = gains.weight or (arm.B, B_inverse, dB)
    # (3.38)
    C_e = coriolis_product(partial(coriolis_forces, model, scratch), arm.Cv, v, e_n)
    alpha_n = gains.acceleration(
        J,
        v,
        J_pinv,
        N,
        W,
        W_inverse,
        dW,
        B_inverse,
        dB,
        gains.k_beta,
        beta,
        task.gradient_rate,
        gains.K_n @ e_n,
        C_e,
    )
    return InternalMotion(J, J_pinv, alpha_n, e_n, task.value)
