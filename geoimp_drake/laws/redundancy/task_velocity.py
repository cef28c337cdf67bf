"""The joint velocity that moves a redundant arm up or down a function of its posture."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.typing import Array

__all__ = ["task_velocity", "task_velocity_rate"]


@compilable
def task_velocity(k_beta: float, B_inverse: Array, gradient: Array) -> Array:
    """Returns (3.39) β = k_β B⁻¹(∂w/∂q)ᵀ (n,): a positive k_β climbs w, a negative one descends.

    Args:
        k_beta: gain k_β; its unit makes β a joint velocity.
        B_inverse: inverse of the joint inertia (n, n).
        gradient: ∂w/∂q (n,).
    """
    return k_beta * (B_inverse @ gradient)


@compilable
def task_velocity_rate(
    k_beta: float, B_inverse: Array, dB: Array, beta: Array, gradient_rate: Array
) -> Array:
    """Returns the time derivative of (3.39), β̇ = B⁻¹(k_β d/dt(∂w/∂q)ᵀ − Ḃβ) (n,).

    Args:
        k_beta: gain k_β.
        B_inverse: inverse of the joint inertia (n, n).
        dB: Ḃ (n, n).
        beta: β (n,).
        gradient_rate: time derivative of ∂w/∂q (n,) along the motion, the explicit dependence of
            w on time included.
    """
    return B_inverse @ (k_beta * gradient_rate - dB @ beta)
