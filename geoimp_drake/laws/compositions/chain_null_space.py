"""The null-space motion of a serial arm in one call: (3.33) and (3.36)-(3.39). Floats only."""

from collections.abc import Callable
from functools import cache

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import local, sized
from geoimp_drake.laws.compositions.null_space_motion import (
    null_space_motion_acceleration,
    null_space_motion_error,
)
from geoimp_drake.laws.dynamics.serial_chain import ChainValues, chain_coriolis
from geoimp_drake.laws.redundancy.null_space_gain import null_space_decay_bound, null_space_force
from geoimp_drake.typing import Array

__all__ = ["chain_null_space"]


@cache
def chain_null_space(n: int) -> Callable[..., tuple[Array, Array, Array, float]]:
    """Returns the law of an arm of n > 6 joints."""

    @compilable
    def law(
        gains: tuple, found: ChainValues, gradient: Array, gradient_rate: Array
    ) -> tuple[Array, Array, Array, float]:
        """Returns J†, α_n and e_n of (3.33), (3.38) and (3.37), and `null_space_decay_bound` for K.

        The bound is zero if κ is not: a K_n = κB decays at the rate κ in every posture.

        Args:
            gains: K and κ of K_n = K + κB (n, n), and the gain k_β of the task function. Then a
                constant W and its inverse (2, n, n), whether (3.36) W = B instead, σ₀ and λ₀ of
                `damped_pseudo_inverse`.
            found: quantities of the arm; ṡ, İ and the forces of the links are overwritten.
            gradient: of the task function (n,).
            gradient_rate: its rate along the arm's motion (n,).
        """
        K, kappa, k_beta, weights, weighs_by_inertia, threshold, factor = gains
        J, v = sized(found.J, 6, n), sized(found.x[n:], n)
        B, dB, Cv = sized(found.B, n, n), sized(found.dB, n, n), sized(found.Cv, n)
        W, W_inverse, dW = sized(weights[0], n, n), sized(weights[1], n, n), 0.0 * B
        K_n = sized(K, n, n)
        B_inverse, J_pinv, N, beta, e_n = null_space_motion_error(
            J,
            B,
            W_inverse,
            weighs_by_inertia,
            threshold,
            factor,
            k_beta,
            sized(gradient, n),
            v,
        )
        if weighs_by_inertia:
            W, W_inverse, dW = B, B_inverse, dB
        # C e_n as in `null_space_acceleration.coriolis_product`.
        c_moved, c_e = local(v), local(v)
        chain_coriolis(local(v + e_n), found, c_moved)
        chain_coriolis(local(e_n), found, c_e)
        alpha_n = null_space_motion_acceleration(
            J,
            v,
            J_pinv,
            N,
            W,
            W_inverse,
            dW,
            B_inverse,
            dB,
            k_beta,
            beta,
            sized(gradient_rate, n),
            null_space_force(K_n, kappa, B, e_n),
            0.5 * (sized(c_moved, n) - Cv - sized(c_e, n)),
        )
        bound = null_space_decay_bound(N, B_inverse, K_n) if kappa == 0.0 else 0.0
        return J_pinv, alpha_n, e_n, bound

    return law
