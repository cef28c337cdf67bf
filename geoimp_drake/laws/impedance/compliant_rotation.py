"""The rotation of C from its motion relative to D: shared by three of the four families."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.rotations.so3 import cross
from geoimp_drake.typing import Array

__all__ = ["angular_acceleration", "angular_velocity", "relative_angular_velocity"]


@compilable
def relative_angular_velocity(R_WC: Array, w_WD: Array, w_WC: Array) -> Array:
    """(3.12) Δᶜω_dc = R_cᵀ(ω_d − ω_c) (3,), in C [rad/s], from both in W."""
    return R_WC.T @ (w_WD - w_WC)


@compilable
def angular_velocity(w_WD: Array, R_WC: Array, w_CD_C: Array) -> Array:
    """(3.22) ω_c = ω_d − R_c Δᶜω_dc (3,), in W [rad/s]."""
    return w_WD - R_WC @ w_CD_C


@compilable
def angular_acceleration(
    dw_WD: Array, R_WC: Array, w_WC: Array, w_CD_C: Array, dw_CD_C: Array
) -> Array:
    """(3.22) ω̇_c = ω̇_d − R_c(Δᶜω̇_dc + S(ᶜω_c) Δᶜω_dc), the derivative of `angular_velocity`.

    Args:
        dw_WD: angular acceleration of D (3,), in W [rad/s²].
        R_WC: orientation of C (3, 3).
        w_WC: angular velocity of C (3,), in W [rad/s].
        w_CD_C: Δᶜω_dc (3,), in C [rad/s].
        dw_CD_C: Δᶜω̇_dc, the derivative of those components (3,) [rad/s²].

    Returns:
        ω̇_c (3,), in W [rad/s²].
    """
    return dw_WD - R_WC @ (dw_CD_C + cross(R_WC.T @ w_WC, w_CD_C))
