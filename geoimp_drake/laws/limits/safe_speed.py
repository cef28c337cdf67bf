"""The speed at which an impact stays below a force, and how far D may lead C for the same force."""

import math

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import sized
from geoimp_drake.typing import Array

__all__ = ["leashed", "safe_speed"]


@compilable
def safe_speed(
    direction: Array, force: float, stiffness: float, mobility: Array, M_p: Array, D_p: Array
) -> float:
    """(L.8) v ≤ F / (nᵀDn + √(max(m_eff, nᵀMn) k)), m_eff = 1 / nᵀΛ⁻¹n [m/s]. Floats only.

    The first term is the force of the damper by which D, still moving, pulls C, which the body has
    stopped. The second is the force of a mass of that speed on a spring. Where the wrist yields
    sideways, m_eff is small, but the controller gives the arm the mass M: the larger one counts.
    The speed is zero in a direction in which the arm cannot move.

    Args:
        direction: n, unit (3,), in W.
        force: F [N].
        stiffness: k of the contact [N/m].
        mobility: translational part of Λ⁻¹ = J B⁻¹ Jᵀ (3, 3), in W [1/kg].
        M_p: M, mass of the impedance (3, 3), in W [kg].
        D_p: D, its damping (3, 3), in W [Ns/m].
    """
    n = sized(direction, 3)
    gives = n @ (sized(mobility, 3, 3) @ n)
    if gives <= 0.0:
        return 0.0
    mass = max(1.0 / gives, n @ (sized(M_p, 3, 3) @ n))
    return force / (n @ (sized(D_p, 3, 3) @ n) + math.sqrt(mass * stiffness))


@compilable
def leashed(difference: Array, gain: Array, most: float) -> Array:
    """(L.9) x min(1, f / ‖Gx‖): a difference whose spring or damper pulls with f at most (3,).

    Floats only.

    Args:
        difference: x of D from C, a position or a velocity (3,), in W [m or m/s].
        gain: G, K_p or D_p (3, 3), in W [N/m or Ns/m].
        most: f [N].
    """
    x = sized(difference, 3)
    pull = sized(gain, 3, 3) @ x
    size = math.sqrt(pull @ pull)
    return x * (1.0 if size <= most else most / size)
