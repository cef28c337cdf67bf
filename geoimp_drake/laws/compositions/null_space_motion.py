"""The null-space motion of a redundant arm: its laws (3.33) to (3.39) in the order of evaluation.

The Coriolis forces of (3.38) depend on the error (3.37), so there are two parts.
"""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.dynamics.linear_equations import inverse
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import (
    pseudo_inverse_with,
    singular_value_or_bound,
)
from geoimp_drake.laws.redundancy.geometric_jacobian import jacobian_rate
from geoimp_drake.laws.redundancy.null_space_acceleration import null_space_acceleration
from geoimp_drake.laws.redundancy.null_space_velocity import null_space_velocity_error
from geoimp_drake.laws.redundancy.pseudo_inverse import pseudo_inverse_rate
from geoimp_drake.laws.redundancy.task_velocity import task_velocity, task_velocity_rate
from geoimp_drake.typing import Array

__all__ = ["null_space_motion_acceleration", "null_space_motion_error"]


@compilable
def null_space_motion_error(
    J: Array,
    B: Array,
    W_inverse: Array,
    weighs_by_inertia: bool,
    threshold: float,
    factor: float,
    k_beta: float,
    gradient: Array,
    v: Array,
) -> tuple[Array, Array, Array, Array, Array]:
    """Returns B⁻¹, J† of (3.33), N = I − J†J, β of (3.39) and e_n of (3.37).

    Args:
        J: Jacobian (6, n).
        B: joint inertia (n, n).
        W_inverse: inverse of a constant weight (n, n).
        weighs_by_inertia: (3.36) W = B instead.
        threshold: σ₀ of `damped_pseudo_inverse`.
        factor: λ₀ of the same.
        k_beta: gain of the task function.
        gradient: of the task function (n,).
        v: joint velocity (n,).
    """
    sigma, B_inverse = singular_value_or_bound(J, threshold), inverse(B)
    W_inverse = B_inverse if weighs_by_inertia else W_inverse
    J_pinv, N = pseudo_inverse_with(J, W_inverse, sigma, threshold, factor)
    beta = task_velocity(k_beta, B_inverse, gradient)
    return B_inverse, J_pinv, N, beta, null_space_velocity_error(N, beta, v)


@compilable
def null_space_motion_acceleration(
    J: Array,
    v: Array,
    J_pinv: Array,
    N: Array,
    W: Array,
    W_inverse: Array,
    dW: Array,
    B_inverse: Array,
    dB: Array,
    k_beta: float,
    beta: Array,
    gradient_rate: Array,
    K_n_e: Array,
    C_e: Array,
) -> Array:
    """Returns α_n of (3.38) (n,) [rad/s², m/s²].

    Args:
        J: Jacobian (6, n).
        v: joint velocity (n,).
        J_pinv: J† (n, 6).
        N: null-space projector (n, n).
        W: weight (n, n); with its inverse and its time derivative.
        W_inverse: see W.
        dW: see W.
        B_inverse: inverse of the joint inertia (n, n).
        dB: Ḃ (n, n).
        k_beta: gain of the task function.
        beta: β (n,).
        gradient_rate: rate of the task function's gradient (n,).
        K_n_e: K_n e_n (n,).
        C_e: C e_n (n,).
    """
    dJ_pinv = pseudo_inverse_rate(J_pinv, N, jacobian_rate(J, v), W, W_inverse, dW)
    dbeta = task_velocity_rate(k_beta, B_inverse, dB, beta, gradient_rate)
    J_u = J @ (beta - v)
    return null_space_acceleration(N, dbeta, dJ_pinv, J_u, B_inverse, K_n_e, C_e)
