"""How the geometric Jacobian of a serial arm changes with the posture, from its columns alone.

Column j of J is the velocity [ω_j; v_j] that joint j, counted from the base, gives a frame of the
arm. A joint turns all axes further out, and moves the frame's origin:

    ∂ω_j/∂q_i = ω_i × ω_j  for i ≤ j, else 0,    ∂v_j/∂q_i = ω_i × v_j  for i ≤ j, else ω_j × v_i.

This holds for revolute and prismatic joints (ω_j = 0), and for a frame on any link: the columns of
joints beyond it are zero.
"""

import numpy as np

from geoimp_drake.typing import Array

__all__ = ["jacobian_pullback", "jacobian_rate"]


def jacobian_rate(J: Array, v: Array) -> Array:
    """Returns J̇ (6, n), the derivative of the geometric Jacobian along the joint velocity; exact.

    Args:
        J: geometric Jacobian (6, n) of a frame of the arm, rows [angular; linear], in W.
        v: joint velocity q̇ (n,).
    """
    through = (J * v).cumsum(axis=1)
    w, beyond = through[:3], through[3:, -1:] - through[3:]
    return np.concatenate((_cross(w, J[:3]), _cross(w, J[3:]) + _cross(J[:3], beyond)))


def jacobian_pullback(J_i: Array, J_j: Array, G: Array) -> Array:
    """Returns the gradient (n,) of ⟨G, J(q)⟩ for a constant G: entry i is Σ G : ∂J/∂q_i.

    Args:
        J_i: geometric Jacobian (6, n) from which the columns of joint i are taken.
        J_j: the one for the columns of joint j. Both are J; the derivatives of J are products of
            two columns, so that their rates follow from J̇ in the place of one and of the other.
        G: (6, n).
    """
    turned = _cross(J_j[:3], G[:3]) + _cross(J_j[3:], G[3:])
    moved = _cross(G[3:], J_j[:3])
    outward = turned[:, ::-1].cumsum(axis=1)[:, ::-1]  # over j ≥ i
    inward = moved.cumsum(axis=1) - moved  # over j < i
    return (J_i[:3] * outward + J_i[3:] * inward).sum(axis=0)


def _cross(a: Array, b: Array) -> Array:
    """Returns the cross products of the columns of two arrays (3, n)."""
    return _LEVI_CIVITA @ (a[:, None] * b).reshape(9, -1)


# ε_ijk with j and k in one index: a third of the time of six products of rows.
_LEVI_CIVITA = np.zeros((3, 9))
_LEVI_CIVITA[[0, 1, 2], [5, 6, 1]] = 1.0
_LEVI_CIVITA[[0, 1, 2], [7, 2, 3]] = -1.0
