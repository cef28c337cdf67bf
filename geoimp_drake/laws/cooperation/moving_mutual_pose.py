"""References (4.10)-(4.15) of two hands whose mutual pose moves: the derivatives of the poses.

The mutual position is given in C: ᶜΔp_r21 with the derivatives of its entries. The mutual
orientation ¹Q_r21 is given in the first hand, with the angular velocity ¹ω_r21 and the derivative
of its entries. C stays in the middle whatever the mutual pose does: (4.1) and (4.4) of the
references give C.
"""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.cooperation.half_rotation import half_rotation_motion
from geoimp_drake.laws.sensing.sensed_wrench import inertial_acceleration
from geoimp_drake.rotations.quaternion import conjugate, product, to_rotation
from geoimp_drake.rotations.so3 import cross
from geoimp_drake.typing import Array

__all__ = ["mutual_position_motion", "reference_rotations"]

# Orientation, angular velocity and angular acceleration of a frame in W.
_Rotation = tuple[Array, Array, Array]


@compilable
def mutual_position_motion(
    R_WC: Array, w_WC: Array, dw_WC: Array, p_12_C: Array, v_12_C: Array, a_12_C: Array
) -> tuple[Array, Array, Array]:
    """(4.14) Δp_r21 = R_c ᶜΔp_r21 and its two derivatives (3,) each, in W [m, m/s, m/s²].

    Args:
        R_WC: orientation of C (3, 3).
        w_WC: its angular velocity (3,), in W [rad/s].
        dw_WC: its angular acceleration (3,), in W [rad/s²].
        p_12_C: ᶜΔp_r21 (3,), in C [m].
        v_12_C: the derivative of those entries (3,) [m/s].
        a_12_C: their second derivative (3,) [m/s²].
    """
    p, v = R_WC @ p_12_C, R_WC @ v_12_C
    coriolis = 2.0 * cross(w_WC, v)
    return p, v + cross(w_WC, p), inertial_acceleration(R_WC @ a_12_C + coriolis, w_WC, dw_WC, p)


@compilable
def reference_rotations(
    Q_WC: Array, w_WC: Array, dw_WC: Array, Q_12: Array, w_12_1: Array, dw_12_1: Array
) -> tuple[_Rotation, _Rotation]:
    """(4.12), (4.13) Q_r1, Q_r2 with the angular velocities and accelerations that belong to them.

    With H, the half of ¹Q_r21, the hands are at Q_c * H⁻¹ and Q_c * H. Their angular velocities are
    ω_c ∓ ½ Δω_r21 of (4.14), (4.15) if ¹r_r21 is constant, and differ from these if the axis moves.

    Args:
        Q_WC: orientation of C (4,).
        w_WC: its angular velocity (3,), in W [rad/s].
        dw_WC: its angular acceleration (3,), in W [rad/s²].
        Q_12: ¹Q_r21 (4,).
        w_12_1: ¹ω_r21 (3,), in the first hand [rad/s].
        dw_12_1: the derivative of those entries (3,) [rad/s²].

    Returns:
        Of each hand the orientation (4,), ω (3,) and ω̇ (3,), in W.
    """
    H, w_H, dw_H = half_rotation_motion(Q_12, w_12_1, dw_12_1)
    # H⁻¹ turns with −R(H)ᵀω_H, and the derivative of that has no further term: ω_H × ω_H = 0.
    R_WC, R_H = to_rotation(Q_WC), to_rotation(H)
    w_back, dw_back = -(R_H.T @ w_H), -(R_H.T @ dw_H)
    first = _turned(Q_WC, R_WC, w_WC, dw_WC, conjugate(H), w_back, dw_back)
    return first, _turned(Q_WC, R_WC, w_WC, dw_WC, H, w_H, dw_H)


@compilable
def _turned(
    Q_WC: Array, R_WC: Array, w_WC: Array, dw_WC: Array, Q_CF: Array, w_CF: Array, dw_CF: Array
) -> _Rotation:
    """The rotation of a frame F in W from that of C in W and that of F in C."""
    w_CF_W = R_WC @ w_CF
    return (
        product(Q_WC, Q_CF),
        w_WC + w_CF_W,
        dw_WC + cross(w_WC, w_CF_W) + R_WC @ dw_CF,
    )
