"""The null-space motion of a serial arm in one call: (3.33) and (3.36)-(3.39). Floats only."""

from collections.abc import Callable
from functools import cache

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import sized, stored
from geoimp_drake.laws.compositions.null_space_motion import (
    null_space_motion_acceleration,
    null_space_motion_error,
)
from geoimp_drake.laws.dynamics.serial_chain import chain_coriolis
from geoimp_drake.laws.redundancy.null_space_gain import null_space_decay_bound, null_space_force
from geoimp_drake.typing import Array

__all__ = ["chain_null_space"]


@cache
def chain_null_space(n: int) -> Callable[..., tuple[Array, Array, Array, float]]:
    """Returns the law of an arm of n > 6 joints."""

    @compilable
    def law(
        columns: Array,
        velocity: Array,
        inertia: Array,
        inertia_rate: Array,
        coriolis: Array,
        s: Array,
        links: Array,
        gradient: Array,
        gradient_rate: Array,
        K: Array,
        kappa: float,
        k_beta: float,
        weights: Array,
        weighs_by_inertia: bool,
        threshold: float,
        factor: float,
    ) -> tuple[Array, Array, Array, float]:
        """Returns J†, α_n and e_n of (3.33), (3.38) and (3.37), and `null_space_decay_bound` for K.

        Args:
            columns: Jacobian (6, n).
            velocity: of the joints (n,).
            inertia: B (n, n).
            inertia_rate: Ḃ (n, n).
            coriolis: Cq̇ (n,).
            s: the joints' axes, of `chain_posture` (n, 6).
            links: the links' inertias, of `chain_posture` (n, 10).
            gradient: of the task function (n,).
            gradient_rate: its rate along the arm's motion (n,).
            K: of K_n = K + κB (n, n).
            kappa: rate κ.
            k_beta: gain of the task function.
            weights: a constant W and its inverse (2, n, n).
            weighs_by_inertia: (3.36) W = B instead.
            threshold: σ₀ of `damped_pseudo_inverse`.
            factor: λ₀ of the same.
        """
        J, v = sized(columns, 6, n), sized(velocity, n)
        B, dB, Cv = sized(inertia, n, n), sized(inertia_rate, n, n), sized(coriolis, n)
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
        # C e_n as `null_space_acceleration.coriolis_product` finds it.
        c_moved = sized(chain_coriolis(s, links, stored(v + e_n)), n)
        c_e = sized(chain_coriolis(s, links, stored(e_n)), n)
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
            0.5 * (c_moved - Cv - c_e),
        )
        bound = null_space_decay_bound(N, B_inverse, K_n) if kappa == 0.0 else 0.0
        return J_pinv, alpha_n, e_n, bound

    return law
