"""The rotational impedance on the difference of the Euler angles of D and C.

It is here for comparison. Its stiffness depends on the attitude of C in W, and its equations change
when W is turned. Near pitch ±π/2 a moment in the null space of Tᵀ moves nothing.
"""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.rotations import euler
from geoimp_drake.rotations.quaternion import to_rotation
from geoimp_drake.typing import Array

__all__ = [
    "angular_acceleration",
    "compliant_angular_acceleration",
    "displacement_acceleration",
    "elastic_moment",
    "elastic_moment_W",
    "moment_axes",
]


@compilable
def displacement_acceleration(
    dphi: Array, dphi_dot: Array, T_c: Array, mu_W: Array, M_inv: Array, D_o: Array, K_o: Array
) -> Array:
    """(3.3) M_o Δφ̈_dc + D_o Δφ̇_dc + K_o Δφ_dc = Tᵀ(φ_c) μ, solved for Δφ̈_dc.

    Args:
        dphi: Δφ_dc = φ_d − φ_c (3,) [rad].
        dphi_dot: Δφ̇_dc (3,) [rad/s].
        T_c: T(φ_c) (3, 3).
        mu_W: moment by the end effector on the environment (3,), in W [Nm].
        M_inv: M_o⁻¹ (3, 3) [1/(kg m²)].
        D_o: damping (3, 3) [Nms/rad].
        K_o: stiffness (3, 3) [Nm/rad].

    Returns:
        Δφ̈_dc (3,) [rad/s²].
    """
    return M_inv @ (T_c.T @ mu_W - D_o @ dphi_dot - K_o @ dphi)


@compilable
def elastic_moment(dphi: Array, phi_c: Array, K_o: Array) -> Array:
    """(3.5) μ_E = T⁻ᵀ(φ_c) K_o Δφ_dc (3,), in W [Nm]: the moment that holds the spring at rest."""
    return euler.T_inverse(phi_c).T @ (K_o @ dphi)


@compilable
def elastic_moment_W(Q_WD: Array, Q_WC: Array, K_o: Array) -> Array:
    """(3.5) T⁻ᵀ(φ_c) K_o Δφ_dc (3,), in W [Nm], of two attitudes (4,)."""
    phi_d = euler.from_rotation(to_rotation(Q_WD))
    phi_c = euler.from_rotation(to_rotation(Q_WC))
    return elastic_moment(euler.wrapped(phi_d - phi_c), phi_c, K_o)


@compilable
def moment_axes(Q_WC: Array) -> Array:
    """(3.5) T⁻ᵀ(φ_c) (3, 3), which maps a moment dual to the angles to the moment in W."""
    return euler.T_inverse(euler.from_rotation(to_rotation(Q_WC))).T


@compilable
def angular_acceleration(T_c: Array, phi_c: Array, phi_dot_c: Array, ddphi_c: Array) -> Array:
    """(3.3) ω̇_c = T(φ_c) φ̈_c + Ṫ(φ_c, φ̇_c) φ̇_c (3,), in W [rad/s²], with φ̈_c = φ̈_d − Δφ̈_dc."""
    return T_c @ ddphi_c + euler.T_dot(phi_c, phi_dot_c) @ phi_dot_c


@compilable
def compliant_angular_acceleration(
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
    """ω̇_c (3,), in W [rad/s²], by (3.3); arguments as of `OrientationImpedance.law`."""
    phi_d = euler.from_rotation(to_rotation(Q_WD))
    phi_c = euler.from_rotation(to_rotation(Q_WC))
    phi_dot_d, ddphi_d = euler.rates(phi_d, w_WD, dw_WD)
    phi_dot_c, T_c = euler.T_inverse(phi_c) @ w_WC, euler.T(phi_c)
    dphi, dphi_dot = euler.wrapped(phi_d - phi_c), phi_dot_d - phi_dot_c
    ddphi = displacement_acceleration(dphi, dphi_dot, T_c, mu_W, M_inv, D_o, K_o)
    return angular_acceleration(T_c, phi_c, phi_dot_c, ddphi_d - ddphi)
