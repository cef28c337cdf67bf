"""The rotational impedance on an angle/axis displacement, derived from its energies.

`o` is ᶜo_dc and `Omega` is Ω, both from `rotations.angle_axis`.
"""

from collections.abc import Callable
from functools import cache

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.impedance import compliant_rotation
from geoimp_drake.rotations.angle_axis import Representation, displacement_of, omega_of
from geoimp_drake.rotations.quaternion import relative, to_rotation
from geoimp_drake.typing import Array

__all__ = [
    "angular_acceleration",
    "damping_moment",
    "elastic_moment",
    "elastic_moment_W",
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


@compilable
def kinetic_energy(w_CD_C: Array, M_o: Array) -> float:
    """(3.15) 𝒯_o = ½ Δᶜωᵀ M_o Δᶜω [J]."""
    return 0.5 * (w_CD_C @ (M_o @ w_CD_C))


@compilable
def potential_energy(o: Array, K_o: Array, psi: float) -> float:
    """(3.16) 𝒰_o = ψ ᶜoᵀ K_o ᶜo [J]."""
    return psi * (o @ (K_o @ o))


@compilable
def inertial_moment(dw_CD_C: Array, M_o: Array) -> Array:
    """(3.18) ᶜμ_I = M_o Δᶜω̇_dc (3,), in C [Nm]; (3.17) its power is the kinetic energy's rate."""
    return M_o @ dw_CD_C


@compilable
def elastic_moment(o: Array, Omega: Array, K_o: Array, psi: float) -> Array:
    """(3.20) ᶜμ_E = 2ψ Ωᵀ K_o ᶜo (3,), in C [Nm]; (3.19) its power is the potential's rate."""
    return (2.0 * psi) * (Omega.T @ (K_o @ o))


@cache
def elastic_moment_W(row: Representation) -> Callable[..., Array]:
    """Returns the law for (3.20) R_c K′_o ᶜo_dc (3,), in W [Nm], of a row of Table 2.1.

    Its arguments are those of `OrientationImpedance.elastic_law`.
    """
    coefficients, psi_of_row = row.coefficients, psi(row.f_prime_at_zero)

    @compilable
    def law(Q_WD: Array, Q_WC: Array, K_o: Array) -> Array:
        Q_CD = relative(Q_WC, Q_WD)
        o, Omega = displacement_of(coefficients, Q_CD), omega_of(coefficients, Q_CD)
        return to_rotation(Q_WC) @ elastic_moment(o, Omega, K_o, psi_of_row)

    return law


@compilable
def damping_moment(w_CD_C: Array, D_o: Array) -> Array:
    """(3.21) ᶜμ_D = D_o Δᶜω_dc (3,), in C [Nm]."""
    return D_o @ w_CD_C


@compilable
def rotational_stiffness(Omega: Array, K_o: Array, psi: float) -> Array:
    """(3.23) K′_o = 2ψ Ωᵀ K_o (3, 3) [Nm/rad]."""
    return (2.0 * psi) * (Omega.T @ K_o)


@compilable
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


@cache
def angular_acceleration(row: Representation) -> Callable[..., Array]:
    """Returns the law for ω̇_c (3,), in W [rad/s²], by (3.22), of a row of Table 2.1.

    Its arguments are those of `OrientationImpedance.law`.
    """
    coefficients, psi_of_row = row.coefficients, psi(row.f_prime_at_zero)

    @compilable
    def law(
        Q_WD: Array,
        w_WD: Array,
        dw_WD: Array,
        Q_WC: Array,
        w_WC: Array,
        mu_W: Array,
        M_inv: Array,
        D_o: Array,
        K_o: Array,
    ) -> Array:
        R_WC, Q_CD = to_rotation(Q_WC), relative(Q_WC, Q_WD)
        w_CD_C = compliant_rotation.relative_angular_velocity(R_WC, w_WD, w_WC)
        o, Omega = displacement_of(coefficients, Q_CD), omega_of(coefficients, Q_CD)
        dw_CD_C = relative_angular_acceleration(
            elastic_moment(o, Omega, K_o, psi_of_row), w_CD_C, R_WC.T @ mu_W, M_inv, D_o
        )
        return compliant_rotation.angular_acceleration(dw_WD, R_WC, w_WC, w_CD_C, dw_CD_C)

    return law
