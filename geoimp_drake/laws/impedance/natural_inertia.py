"""The six-DOF impedance with the arm's own inertia at E, whose damping follows from a ratio ζ.

    Λ(q)Δv̇ + D(q)Δv + K(Δ) = h,    Λ⁻¹ = J B⁻¹ Jᵀ,    Δ = "D minus E"

needs no h: without Jᵀh in (2.3) the wrench accelerates E by −Λ⁻¹h, as it must. K(Δ) is the elastic
wrench of an orientation family and of (3.1). D gives every mode of Λ and K the damping ratio ζ, as
`damping_design.damping_for_ratio` does. With K₀ = LLᵀ, the stiffness where E equals D, and
S = LᵀΛ⁻¹L, whose eigenvalues are the squares of the modes' frequencies,

    Λ⁻¹D = 2ζ L⁻ᵀ S^½ Lᵀ.

Only Λ⁻¹ is needed, which may be singular, so a singular posture is no exception for this law.
Floats only.
"""

from collections.abc import Callable
from functools import cache

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import joined, sized, stored
from geoimp_drake.laws.dynamics.linear_equations import inverse, solution
from geoimp_drake.laws.frame_motion import (
    ACCELERATION,
    FRAME_MOTION_SIZE,
    FRAME_STATE_SIZE,
    POSITION,
    QUATERNION,
    VELOCITY,
    is_frame_motion,
)
from geoimp_drake.laws.impedance.compliant_motion import has_diverged
from geoimp_drake.laws.impedance.coupled_stiffness import without_coupling
from geoimp_drake.laws.impedance.translational_impedance import turned
from geoimp_drake.rotations.quaternion import to_rotation
from geoimp_drake.typing import Array

__all__ = ["damping_acceleration", "mobility", "natural_motion"]

_NONE = np.zeros(3)


@compilable
def mobility(J: Array, B: Array) -> Array:
    """(3.34) Λ⁻¹ = J B⁻¹ Jᵀ (6, 6), from a wrench on E to the acceleration of E that it causes.

    Args:
        J: Jacobian of the end effector (6, n), its rows [angular; linear], in W.
        B: joint inertia (n, n).
    """
    return J @ (inverse(B) @ J.T)


@compilable
def damping_acceleration(G: Array, L: Array, zeta: float, dV: Array) -> Array:
    """(3.1 natural) Λ⁻¹DΔv = 2ζ L⁻ᵀ (LᵀΛ⁻¹L)^½ Lᵀ Δv (6,), with which every mode has the ratio ζ.

    Args:
        G: Λ⁻¹ (6, 6), which may be singular.
        L: any square root of the stiffness, K₀ = LLᵀ (6, 6).
        zeta: ζ, 1 for critical damping.
        dV: Δv (6,), [angular; linear] in W.
    """
    squares, V = np.linalg.eigh(stored(L.T @ G @ L))
    y = V.T @ stored(L.T @ dV)
    damped = V @ (np.sqrt(np.maximum(squares, 0.0)) * y)
    return (2.0 * zeta) * solution(L.T, sized(damped, 6))


@cache
def natural_motion(
    elastic_moment: Callable[..., Array], moment_axes: Callable[..., Array]
) -> Callable[..., bool]:
    """Returns the law (3.1 natural) for an orientation family.

    Args:
        elastic_moment: the family's `elastic_law`, see `orientation_impedance`.
        moment_axes: its `axes_law`.
    """

    def law(
        state: Array,
        desired: Array,
        mobility: Array,
        K_p: Array,
        K_o: Array,
        coupling: Array,
        couples: bool,
        in_desired: bool,
        factor: Array,
        zeta: float,
        motion: Array,
        damping: Array,
    ) -> bool:
        """Writes pose and velocity of E, and the acceleration required of it.

        Returns False if an input is unusable.

        Args:
            state: of E as measured, a frame motion without its accelerations (13,).
            desired: motion of D (19,).
            mobility: Λ⁻¹ (6, 6), in W.
            K_p: stiffness (3, 3), in W or in D; with a coupling, in D [N/m].
            K_o: stiffness (3, 3) [Nm/rad].
            coupling: K_c (3, 3), in D [N].
            couples: whether the coupling takes part.
            in_desired: whether K_p is in D.
            factor: lower Cholesky factor of the stiffness where E equals D (6, 6), in the axes of
                the gains, see `coupled_stiffness.stiffness_matrix`.
            zeta: ζ of every mode.
            motion: of E, which takes the place of C, with that acceleration (19,); where to write.
            damping: Λ⁻¹DΔv (6,), where to write.
        """
        if not is_frame_motion(desired) or has_diverged(state):
            return False
        D, E = sized(desired, FRAME_MOTION_SIZE), sized(state, FRAME_STATE_SIZE)
        Q_WD, Q_WE, dp = D[QUATERNION], E[QUATERNION], D[POSITION] - E[POSITION]
        moment, force, K = sized(_NONE, 3), sized(_NONE, 3), sized(K_p, 3, 3)
        L = np.zeros((6, 6))
        L[:3, :3] = moment_axes(Q_WE) @ sized(factor[:3, :3], 3, 3)
        L[3:6, :6] = sized(factor[3:], 3, 6)
        if couples:
            K_c = sized(coupling, 3, 3)
            moment, force, K = without_coupling(Q_WD, Q_WE, dp, moment, force, K, K_c)
        elif in_desired:
            K = turned(K, to_rotation(Q_WD))
        if couples or in_desired:
            L[3:6, :6] = to_rotation(Q_WD) @ sized(factor[3:], 3, 6)
        elastic = joined(elastic_moment(Q_WD, Q_WE, sized(K_o, 3, 3)) - moment, K @ dp - force)
        G = sized(mobility, 6, 6)
        damped = damping_acceleration(G, sized(L, 6, 6), zeta, D[VELOCITY] - E[VELOCITY])
        motion[:FRAME_STATE_SIZE] = E
        motion[ACCELERATION] = D[ACCELERATION] + G @ elastic + damped
        damping[:6] = damped
        return True

    return law
