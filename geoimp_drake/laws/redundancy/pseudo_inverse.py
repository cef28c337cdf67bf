"""The weighted pseudo-inverse of the Jacobian and its time derivative."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import identity_like
from geoimp_drake.laws.dynamics.linear_equations import inverse
from geoimp_drake.typing import Array

__all__ = ["null_space_projector", "pseudo_inverse_rate", "weighted_pseudo_inverse"]


@compilable
def weighted_pseudo_inverse(J: Array, W_inverse: Array) -> Array:
    """Returns (3.33) J† = W⁻¹Jᵀ(JW⁻¹Jᵀ)⁻¹ (n, 6).

    With (3.36) W = B, the inertia matrix, it is dynamically consistent. By (3.34), (3.35) a wrench
    at the end effector then causes no null-space joint acceleration.

    Args:
        J: Jacobian of the end effector (6, n), its rows [angular; linear], in W, of full rank.
        W_inverse: inverse of the weight, symmetric positive definite (n, n).
    """
    W_inverse_Jt = W_inverse @ J.T
    return W_inverse_Jt @ inverse(J @ W_inverse_Jt)


@compilable
def null_space_projector(J: Array, J_pinv: Array) -> Array:
    """Returns I − J†J (n, n): joint velocities in its range do not move the end effector."""
    P = J_pinv @ J
    return identity_like(P) - P


@compilable
def pseudo_inverse_rate(
    J_pinv: Array, N: Array, dJ: Array, W: Array, W_inverse: Array, dW: Array
) -> Array:
    """Returns the time derivative J̇† (n, 6) of (3.33), which (3.38) needs; exact.

        J̇† = N W⁻¹(J̇ᵀJ†ᵀW − Ẇ)J† − J†J̇J†,   N = I − J†J.

    It follows from (3.33) with (JW⁻¹Jᵀ)⁻¹ = J†ᵀWJ†, and is defined wherever J† is.

    Args:
        J_pinv: J† (n, 6).
        N: null-space projector (n, n).
        dJ: J̇ (6, n).
        W: weight (n, n).
        W_inverse: its inverse.
        dW: its time derivative; zero for a constant weight, Ḃ for W = B.
    """
    return (N @ W_inverse @ (dJ.T @ (J_pinv.T @ W) - dW) - J_pinv @ dJ) @ J_pinv
