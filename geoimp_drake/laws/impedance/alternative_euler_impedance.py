"""The rotational impedance on the Euler angles of the orientation of D seen from C.

It does not depend on the attitude of C; its principal axes are those of K_o only if K_o is
diagonal.
"""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.impedance import compliant_rotation
from geoimp_drake.rotations import euler
from geoimp_drake.rotations.quaternion import relative, to_rotation
from geoimp_drake.typing import Array

__all__ = [
    "angular_acceleration",
    "displacement_acceleration",
    "elastic_moment",
    "elastic_moment_W",
    "relative_angular_acceleration",
]


@compilable
def displacement_acceleration(
    phi: Array, phi_dot: Array, T_dc: Array, mu_C: Array, M_inv: Array, D_o: Array, K_o: Array
) -> Array:
    """(3.6) M_o φ̈_dc + D_o φ̇_dc + K_o φ_dc = Tᵀ(φ_dc) ᶜμ, solved for φ̈_dc.

    Args:
        phi: φ_dc, the angles of ᶜR_d (3,) [rad].
        phi_dot: φ̇_dc (3,) [rad/s].
        T_dc: T(φ_dc) (3, 3).
        mu_C: moment by the end effector on the environment (3,), in C [Nm].
        M_inv: M_o⁻¹ (3, 3) [1/(kg m²)].
        D_o: damping (3, 3) [Nms/rad].
        K_o: stiffness (3, 3) [Nm/rad].

    Returns:
        φ̈_dc (3,) [rad/s²].
    """
    return M_inv @ (T_dc.T @ mu_C - D_o @ phi_dot - K_o @ phi)


@compilable
def elastic_moment(phi: Array, K_o: Array) -> Array:
    """(3.8) ᶜμ_E = T⁻ᵀ(φ_dc) K_o φ_dc (3,), in C [Nm]: the moment that holds the spring at rest."""
    return euler.T_inverse(phi).T @ (K_o @ phi)


@compilable
def elastic_moment_W(Q_WD: Array, Q_WC: Array, K_o: Array) -> Array:
    """(3.8) R_c T⁻ᵀ(φ_dc) K_o φ_dc (3,), in W [Nm]."""
    phi = euler.from_rotation(to_rotation(relative(Q_WC, Q_WD)))
    return to_rotation(Q_WC) @ elastic_moment(phi, K_o)


@compilable
def relative_angular_acceleration(T_dc: Array, phi: Array, phi_dot: Array, ddphi: Array) -> Array:
    """(3.7) Δᶜω̇_dc = T(φ_dc) φ̈_dc + Ṫ(φ_dc, φ̇_dc) φ̇_dc (3,), in C [rad/s²]."""
    return T_dc @ ddphi + euler.T_dot(phi, phi_dot) @ phi_dot


@compilable
def angular_acceleration(
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
    """ω̇_c (3,), in W [rad/s²], by (3.6) and (3.7); arguments as of `OrientationImpedance.law`."""
    R_WC = to_rotation(Q_WC)
    phi = euler.from_rotation(to_rotation(relative(Q_WC, Q_WD)))
    w_CD_C = compliant_rotation.relative_angular_velocity(R_WC, w_WD, w_WC)
    phi_dot, T = euler.T_inverse(phi) @ w_CD_C, euler.T(phi)
    ddphi = displacement_acceleration(phi, phi_dot, T, R_WC.T @ mu_W, M_inv, D_o, K_o)
    dw_CD_C = relative_angular_acceleration(T, phi, phi_dot, ddphi)
    return compliant_rotation.angular_acceleration(dw_WD, R_WC, w_WC, w_CD_C, dw_CD_C)
