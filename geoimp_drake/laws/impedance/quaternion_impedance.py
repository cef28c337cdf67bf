"""The rotational impedance on the quaternion displacement, which has no singularity.

Moment and potential are the same for Q and −Q, so they are continuous through a half turn as well.
Kinetic energy and damping are those of `angle_axis_impedance`.
"""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import vector
from geoimp_drake.laws.impedance import compliant_rotation
from geoimp_drake.rotations.components import wxyz, xyz
from geoimp_drake.rotations.quaternion import E, relative, to_rotation
from geoimp_drake.typing import Array

__all__ = [
    "angular_acceleration",
    "elastic_moment",
    "elastic_moment_W",
    "potential_energy",
    "relative_angular_acceleration",
    "rotational_stiffness",
]


@compilable
def rotational_stiffness(Q_CD: Array, K_o: Array) -> Array:
    """(3.31) K′_o = 2 Eᵀ(η_dc, ᶜε_dc) K_o (3, 3) [Nm/rad]."""
    return 2.0 * (E(Q_CD).T @ K_o)


@compilable
def elastic_moment(Q_CD: Array, K_o: Array) -> Array:
    """(3.30) K′_o ᶜε_dc = 2(ηI + S(ε))K_oε (3,), in C [Nm]: the gradient of (3.29).

    With K_o = kI it is k sin ϑ about the axis of the displacement: a constant moment above k has no
    equilibrium.
    """
    w, x, y, z = wxyz(Q_CD)
    a, b, c = xyz(K_o @ Q_CD[1:])
    return vector(
        2.0 * (w * a + y * c - z * b), 2.0 * (w * b + z * a - x * c), 2.0 * (w * c + x * b - y * a)
    )


@compilable
def elastic_moment_W(Q_WD: Array, Q_WC: Array, K_o: Array) -> Array:
    """(3.30) R_c K′_o ᶜε_dc (3,), in W [Nm]."""
    return to_rotation(Q_WC) @ elastic_moment(relative(Q_WC, Q_WD), K_o)


@compilable
def potential_energy(Q_CD: Array, K_o: Array) -> float:
    """(3.29) 𝒰_o = 2 ᶜεᵀ K_o ᶜε [J]."""
    epsilon = Q_CD[1:]
    return 2.0 * (epsilon @ (K_o @ epsilon))


@compilable
def relative_angular_acceleration(
    Q_CD: Array, w_CD_C: Array, mu_C: Array, M_inv: Array, D_o: Array, K_o: Array
) -> Array:
    """(3.30) M_o Δᶜω̇_dc + D_o Δᶜω_dc + K′_o ᶜε_dc = ᶜμ, solved for Δᶜω̇_dc.

    Args:
        Q_CD: {η_dc, ᶜε_dc} (4,).
        w_CD_C: Δᶜω_dc (3,), in C [rad/s].
        mu_C: moment by the end effector on the environment (3,), in C [Nm].
        M_inv: M_o⁻¹ (3, 3) [1/(kg m²)].
        D_o: damping (3, 3) [Nms/rad].
        K_o: stiffness (3, 3) [Nm/rad].

    Returns:
        Δᶜω̇_dc (3,) [rad/s²].
    """
    return M_inv @ (mu_C - D_o @ w_CD_C - elastic_moment(Q_CD, K_o))


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
    """ω̇_c (3,), in W [rad/s²], by (3.30) and (3.22); arguments as of `OrientationImpedance.law`."""
    R_WC = to_rotation(Q_WC)
    w_CD_C = compliant_rotation.relative_angular_velocity(R_WC, w_WD, w_WC)
    dw_CD_C = relative_angular_acceleration(
        relative(Q_WC, Q_WD), w_CD_C, R_WC.T @ mu_W, M_inv, D_o, K_o
    )
    return compliant_rotation.angular_acceleration(dw_WD, R_WC, w_WC, w_CD_C, dw_CD_C)
