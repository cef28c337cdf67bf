"""How the geometric Jacobian of a serial arm changes with the posture, from its columns alone.

Column j of J is the velocity [ω_j; v_j] that joint j, counted from the base, gives a frame of the
arm. A joint turns all axes further out, and moves the frame's origin:

    ∂ω_j/∂q_i = ω_i × ω_j  for i ≤ j, else 0,    ∂v_j/∂q_i = ω_i × v_j  for i ≤ j, else ω_j × v_i.

This holds for revolute and prismatic joints (ω_j = 0), and for a frame on any link: the columns of
joints beyond it are zero.
"""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import local, sized, sized_like
from geoimp_drake.rotations.so3 import cross
from geoimp_drake.typing import Array

__all__ = ["jacobian_adjoint", "jacobian_rate"]

_ZERO = np.zeros(3)


@compilable
def jacobian_rate(J: Array, v: Array) -> Array:
    """Returns J̇ (6, n), the derivative of the geometric Jacobian along the joint velocity; exact.

    Args:
        J: geometric Jacobian (6, n) of a frame of the arm, rows [angular; linear], in W.
        v: joint velocity q̇ (n,).
    """
    columns, rates, dJ = local(J), local(v), local(J)
    w, beyond = sized(_ZERO, 3), sized(_ZERO, 3)
    for j in range(len(rates)):
        beyond = beyond + rates[j] * sized(columns[3:, j], 3)
    for j in range(len(rates)):
        w_j, v_j, column = sized(columns[:3, j], 3), sized(columns[3:, j], 3), dJ[:, j]
        # How joint j's link turns, and what the joints beyond it add to the frame's velocity.
        w, beyond = w + rates[j] * w_j, beyond - rates[j] * v_j
        column[:3] = cross(w, w_j)
        column[3:6] = cross(w, v_j) + cross(w_j, beyond)
    return sized_like(dJ, J)


def jacobian_adjoint(J: Array, G: Array) -> Array:
    """Returns S (6, n) with which ⟨G, J(q)⟩ for a constant G has the gradient (J * S).sum(axis=0).

    Entry i of that gradient is Σ G : ∂J/∂q_i. S is linear in J and in G, so that its rate is
    S(J̇, G) + S(J, Ġ).

    Args:
        J: geometric Jacobian (6, n) of a frame of the arm, rows [angular; linear], in W.
        G: (6, n).
    """
    w, v, G_w, G_v = J[:3], J[3:], G[:3], G[3:]
    n = J.shape[1]
    products = _cross(np.concatenate((w, v, G_v), axis=1), np.concatenate((G_w, G_v, w), axis=1))
    turned = products[:, :n] + products[:, n : 2 * n]
    moved = products[:, 2 * n :]
    outward = turned[:, ::-1].cumsum(axis=1)[:, ::-1]  # over j ≥ i
    inward = moved.cumsum(axis=1) - moved  # over j < i
    return np.concatenate((outward, inward))


def _cross(a: Array, b: Array) -> Array:
    """Returns the cross products of the columns of two arrays (3, n)."""
    return _LEVI_CIVITA @ (np.expand_dims(a, 1) * b).reshape(9, -1)


# ε_ijk with j and k in one index: a third of the time of six products of rows.
_LEVI_CIVITA = np.zeros((3, 9))
_LEVI_CIVITA[[0, 1, 2], [5, 6, 1]] = 1.0
_LEVI_CIVITA[[0, 1, 2], [7, 2, 3]] = -1.0
