"""Damping D_c between the translation and the rotation of the quaternion impedance."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.typing import Array

__all__ = ["coupled_power", "without_damping"]


@compilable
def coupled_power(w_CD_C: Array, dv_dc: Array, D_c: Array) -> float:
    """(3.21 coupled) Δᶜωᵀ D_c Δṗ [W], which each part dissipates in addition; Δṗ in D_p's axes."""
    return w_CD_C @ (D_c @ dv_dc)


@compilable
def without_damping(
    R_WC: Array, dw_W: Array, dv_W: Array, mu_W: Array, f_W: Array, D_c: Array
) -> tuple[Array, Array]:
    """(3.21 coupled) The load that is left for (3.1) and (3.30), in W: ᶜμ − D_cΔṗ, f − D_cᵀΔᶜω.

    Args:
        R_WC: orientation of C (3, 3).
        dw_W: ω_d − ω_c (3,), in W [rad/s].
        dv_W: Δṗ_dc (3,), in W [m/s].
        mu_W: moment by the end effector on the environment (3,), in W [Nm].
        f_W: force by the end effector on the environment (3,), in W [N].
        D_c: coupling, its rows in C and its columns in W (3, 3) [Ns].
    """
    return mu_W - R_WC @ (D_c @ dv_W), f_W - D_c.T @ (R_WC.T @ dw_W)
