"""The rotational impedance on an angle/axis displacement, derived from its energies.

`o` is ᶜo_dc and `Omega` is Ω, both from `rotations.angle_axis`.
"""

from geoimp_drake.typing import Array

__all__ = [
    "damping_moment",
    "elastic_moment",
    "inertial_moment",
    "kinetic_energy",
    "potential_energy",
    "psi",
    "relative_angular_acceleration",
    "rotational_stiffness",
]


def psi(f_prime_at_zero: float) -> float:
    """(3.26) ψ = 1/(2 f′(0)²), with which the stiffness at zero displacement is K_o."""
    return 0.5 / f_prime_at_zero**2


def kinetic_energy(w_CD_C: Array, M_o: Array) -> float:
    """(3.15) 𝒯_o = ½ Δᶜωᵀ M_o Δᶜω [J]."""
    return 0.5 * (w_CD_C @ (M_o @ w_CD_C))


def potential_energy(o: Array, K_o: Array, psi: float) -> float:
    """(3.16) 𝒰_o = ψ ᶜoᵀ K_o ᶜo [J]."""
    return psi * (o @ (K_o @ o))


def inertial_moment(dw_CD_C: Array, M_o: Array) -> Array:
    """(3.18) ᶜμ_I = M_o Δᶜω̇_dc (3,), in C [Nm]; (3.17) its power is the kinetic energy's rate."""
    return M_o @ dw_CD_C


def elastic_moment(o: Array, Omega: Array, K_o: Array, psi: float) -> Array:
    """(3.20) ᶜμ_E = 2ψ Ωᵀ K_o ᶜo (3,), in C [Nm]; (3.19) its power is the potential's rate."""
    return (2.0 * psi) * (Omega.T @ (K_o @ o))


def damping_moment(w_CD_C: Array, D_o: Array) -> Array:
    """(3.21) ᶜμ_D = D_o Δᶜω_dc (3,), in C [Nm]."""
    return D_o @ w_CD_C


def rotational_stiffness(Omega: Array, K_o: Array, psi: float) -> Array:
    """(3.23) K′_o = 2ψ Ωᵀ K_o (3, 3) [Nm/rad]."""
    return (2.0 * psi) * (Omega.T @ K_o)


def relative_angular_acceleration(
    elastic_C: Array, w_CD_C: Array, mu_C: Array, M_inv: Array, D_o: Array
) -> Array:
    """(3.22) M_o Δᶜω̇_dc + D_o Δᶜω_dc + K′_o ᶜo_dc = ᶜμ, solved for Δᶜω̇_dc.

    Args:
        elastic_C: K′_o ᶜo_dc, the elastic moment (3,), in C [Nm].
        w_CD_C: Δᶜω_dc (3,), in C [rad/s].
        mu_C: moment by the end effector on the environment (3,), in C [Nm].
        M_inv: M_o⁻¹ (3, 3) [1/(kg m²)].
        D_o: damping (3, 3) [Nms/rad].

    Returns:
        Δᶜω̇_dc (3,) [rad/s²].
    """
    return M_inv @ (mu_C - damping_moment(w_CD_C, D_o) - elastic_C)
