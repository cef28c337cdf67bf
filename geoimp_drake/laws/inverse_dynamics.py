"""Inverse dynamics, the inner loop of every controller."""

from geoimp_drake.typing import Array

__all__ = ["inverse_dynamics"]


def inverse_dynamics(
    B: Array, alpha: Array, Cv: Array, Fv: Array, g: Array, J: Array, h: Array
) -> Array:
    """(2.3) τ = Bα + Cq̇ + Fq̇ + g + Jᵀh, which gives (2.4) q̈ = α.

    Args:
        B: joint inertia (n, n), reflected rotor inertia included.
        alpha: the acceleration that the joints shall have (n,) [rad/s², m/s²].
        Cv: Coriolis and centrifugal generalized forces C(q, q̇)q̇ (n,) [Nm, N].
        Fv: viscous friction Fq̇ (n,), with the sign of q̇.
        g: gravity's term (n,): τ = g holds the arm at rest.
        J: Jacobian of the end effector (6, n), its rows [angular; linear], in W.
        h: wrench [moment; force] (6,) by the end effector on the environment, about the end
            effector's origin, in W [Nm, N].

    Returns:
        The actuation τ (n,) [Nm, N].
    """
    return B @ alpha + Cv + Fv + g + J.T @ h
