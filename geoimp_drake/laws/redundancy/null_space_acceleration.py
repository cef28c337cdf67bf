"""The joint acceleration that makes the null-space motion follow a joint velocity."""

from collections.abc import Callable

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.typing import Array

__all__ = ["coriolis_product", "null_space_acceleration"]


@compilable
def null_space_acceleration(
    N: Array, dbeta: Array, dJ_pinv: Array, J_u: Array, B_inverse: Array, K_n_e: Array, C_e: Array
) -> Array:
    """Returns (3.38) α_n = (I − J†J)(β̇ − J̇†J(β − q̇) + B⁻¹(K_n e_n + C e_n)) (n,).

    With W = B the error energy V = ½ e_nᵀBe_n then obeys V̇ = −e_nᵀK_n e_n. The chapter's scan is
    illegible at (3.38); this form is derived from the equation of V̇.

    Args:
        N: null-space projector I − J†J (n, n).
        dbeta: β̇ (n,) [rad/s², m/s²].
        dJ_pinv: J̇† (n, 6).
        J_u: J(β − q̇) (6,).
        B_inverse: inverse of the joint inertia (n, n).
        K_n_e: K_n e_n (n,), K_n symmetric positive definite.
        C_e: C(q, q̇)e_n (n,) with the Christoffel C: Ḃ − 2C is skew; see `coriolis_product`.
    """
    return N @ (dbeta - dJ_pinv @ J_u + B_inverse @ (K_n_e + C_e))


def coriolis_product(c: Callable[[Array], Array], c_v: Array, v: Array, e: Array) -> Array:
    """Returns C(q, v)e (n,) for the Christoffel C of (3.38), exactly.

    c(v) = C(v)v is quadratic in v and its bilinear form C(v)e is symmetric, so by polarisation
    C(v)e = ½[c(v + e) − c(v) − c(e)].

    Args:
        c: Coriolis and centrifugal forces at this posture as a function of the joint velocity.
        c_v: c(v), which is known already.
        v: joint velocity (n,).
        e: (n,).
    """
    return 0.5 * (c(v + e) - c_v - c(e))
