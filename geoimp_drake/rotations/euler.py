"""XYZ Euler angles φ = [roll, pitch, yaw], R = Rx(roll) Ry(pitch) Rz(yaw).

T(φ) relates their rates to the angular velocity in the base frame, ω = T φ̇ (2.11). T(0) = I, and
T is singular at pitch = ±π/2.
"""

import math

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import matrix, vector
from geoimp_drake.errors import SingularityError
from geoimp_drake.rotations.components import rows, xyz
from geoimp_drake.typing import Array

__all__ = [
    "T",
    "T_dot",
    "T_inverse",
    "check_regular",
    "condition_number",
    "from_rotation",
    "rates",
    "to_rotation",
    "wrapped",
]

# The smallest |cos pitch| at which the angles are still used: cond(T) is 2000 there.
SMALLEST_COS_PITCH = 1e-3


@compilable
def to_rotation(phi: Array) -> Array:
    """The rotation matrix Rx Ry Rz (3, 3) of the angles `phi` [rad] (3,)."""
    (sa, sb, sc), (ca, cb, cc) = _sines(phi), _cosines(phi)
    return matrix(
        (cb * cc, -cb * sc, sb),
        (ca * sc + sa * sb * cc, ca * cc - sa * sb * sc, -sa * cb),
        (sa * sc - ca * sb * cc, sa * cc + ca * sb * sc, ca * cb),
    )


@compilable
def from_rotation(R: Array) -> Array:
    """The angles [rad] (3,) of `R`, roll and yaw in (−π, π], pitch in [−π/2, π/2]."""
    (xx, xy, xz), (_, _, yz), (_, _, zz) = rows(R)
    cos_pitch = np.sqrt(xx * xx + xy * xy)
    return vector(np.arctan2(-yz, zz), np.arctan2(xz, cos_pitch), np.arctan2(-xy, xx))


@compilable
def T(phi: Array) -> Array:
    """(2.11) The matrix T (3, 3) with ω = Tφ̇, ω in the base frame, of the angles `phi` [rad]."""
    (sa, sb, _), (ca, cb, _) = _sines(phi), _cosines(phi)
    return matrix((1.0, 0.0, sb), (0.0, ca, -sa * cb), (0.0, sa, ca * cb))


@compilable
def T_inverse(phi: Array) -> Array:
    """The inverse of `T` (3, 3) in closed form: call `check_regular` where it may be singular."""
    (sa, sb, _), (ca, cb, _) = _sines(phi), _cosines(phi)
    return matrix((1.0, sa * sb / cb, -ca * sb / cb), (0.0, ca, sa), (0.0, -sa / cb, ca / cb))


@compilable
def T_dot(phi: Array, phi_dot: Array) -> Array:
    """Ṫ(φ, φ̇) (3, 3), the time derivative of T [1/s]."""
    (sa, sb, _), (ca, cb, _) = _sines(phi), _cosines(phi)
    da, db, _ = xyz(phi_dot)
    return matrix(
        (0.0, 0.0, db * cb),
        (0.0, -da * sa, db * sa * sb - da * ca * cb),
        (0.0, da * ca, -da * sa * cb - db * ca * sb),
    )


@compilable
def rates(phi: Array, w: Array, dw: Array) -> tuple[Array, Array]:
    """φ̇ [rad/s] and φ̈ [rad/s²] of a frame with angular velocity `w` and acceleration `dw`.

    From (2.11): φ̇ = T⁻¹ω, φ̈ = T⁻¹(ω̇ − Ṫφ̇).
    """
    T_inv = T_inverse(phi)
    phi_dot = T_inv @ w
    return phi_dot, T_inv @ (dw - T_dot(phi, phi_dot) @ phi_dot)


@compilable
def wrapped(dphi: Array) -> Array:
    """A difference of angles [rad], each brought into (−π, π]: continuous as an angle wraps."""
    x, y, z = xyz(dphi)
    return vector(_wrapped(x), _wrapped(y), _wrapped(z))


@compilable
def condition_number(phi: Array) -> float:
    """cond(T) = (1 + |sin pitch|) / |cos pitch|, in closed form."""
    pitch = phi[1]
    return (1.0 + abs(np.sin(pitch))) / abs(np.cos(pitch))


def check_regular(phi: Array, name: str = "the Euler angles") -> None:
    """Refuses angles so near pitch = ±π/2 that T(φ) cannot be used.

    Raises:
        SingularityError: |cos pitch| < 1e-3.
    """
    cos_pitch = abs(np.cos(phi[1]))
    if not cos_pitch >= SMALLEST_COS_PITCH:
        raise SingularityError(
            f"{name}: XYZ Euler angles are singular at |cos pitch| = 0, and |cos pitch| is "
            f"{cos_pitch:.3g}, below {SMALLEST_COS_PITCH:g}. Choose another posture, or the "
            "quaternion, which has no singularity."
        )


@compilable
def _wrapped(angle: float) -> float:
    if -math.pi < angle <= math.pi:
        return angle
    return angle - 2.0 * math.pi * np.ceil((angle - math.pi) / (2.0 * math.pi))


@compilable
def _sines(phi: Array) -> tuple[float, float, float]:
    return np.sin(phi[0]), np.sin(phi[1]), np.sin(phi[2])


@compilable
def _cosines(phi: Array) -> tuple[float, float, float]:
    return np.cos(phi[0]), np.cos(phi[1]), np.cos(phi[2])
