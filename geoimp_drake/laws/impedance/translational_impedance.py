"""The translational impedance, its energies and its powers.

Displacements are desired minus compliant, so a force *on the environment* makes Δp_dc positive
along itself: C stays behind D.
"""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.typing import Array

__all__ = [
    "compliant_acceleration",
    "dissipated_power",
    "elastic_force",
    "kinetic_energy",
    "potential_energy",
    "supplied_power",
    "turned",
]


@compilable
def compliant_acceleration(
    ddp_d: Array, dv_dc: Array, dp_dc: Array, f: Array, M_inv: Array, D: Array, K: Array
) -> Array:
    """(3.1) M_p Δp̈_dc + D_p Δṗ_dc + K_p Δp_dc = f, solved for p̈_c = p̈_d − Δp̈_dc.

    Args:
        ddp_d: acceleration of D's origin (3,), in W [m/s²].
        dv_dc: Δṗ_dc = ṗ_d − ṗ_c (3,), in W [m/s].
        dp_dc: Δp_dc = p_d − p_c (3,), in W [m].
        f: force by the end effector on the environment (3,), in W [N].
        M_inv: M_p⁻¹ (3, 3) [1/kg].
        D: D_p (3, 3) [Ns/m].
        K: K_p (3, 3) [N/m].

    Returns:
        p̈_c (3,), in W [m/s²].
    """
    return ddp_d - M_inv @ (f - D @ dv_dc - K @ dp_dc)


@compilable
def elastic_force(dp_dc: Array, K: Array) -> Array:
    """(3.2) f_E = K_p Δp_dc (3,) [N]: along a principal axis of K_p, γ_i times the displacement."""
    return K @ dp_dc


@compilable
def kinetic_energy(dv_dc: Array, M: Array) -> float:
    """(3.1) ½ Δṗᵀ M_p Δṗ [J]."""
    return 0.5 * (dv_dc @ (M @ dv_dc))


@compilable
def potential_energy(dp_dc: Array, K: Array) -> float:
    """(3.1) ½ Δpᵀ K_p Δp [J]; its gradient is the elastic force."""
    return 0.5 * (dp_dc @ (K @ dp_dc))


@compilable
def dissipated_power(dv_dc: Array, D: Array) -> float:
    """(3.1) Δṗᵀ D_p Δṗ [W], never negative."""
    return np.dot(dv_dc, D @ dv_dc)


@compilable
def supplied_power(dv_dc: Array, f: Array) -> float:
    """(3.1) fᵀΔṗ [W] = d(kinetic + potential)/dt + dissipated power."""
    return np.dot(f, dv_dc)


@compilable
def turned(gain: Array, R_WD: Array) -> Array:
    """(3.1) R_d A R_dᵀ (3, 3): a gain A that is given in D's axes, in W."""
    return R_WD @ gain @ R_WD.T
