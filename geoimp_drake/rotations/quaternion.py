"""Unit quaternions Q = [η, ε] = [w, x, y, z] with η = cos(ϑ/2), ε = sin(ϑ/2) r."""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import matrix, vector
from geoimp_drake.errors import SignalError
from geoimp_drake.rotations.components import rows, wxyz, xyz
from geoimp_drake.typing import Array

__all__ = [
    "UNIT_TOLERANCE",
    "E",
    "angle_over_sine",
    "angular_motion",
    "canonical",
    "check_unit",
    "conjugate",
    "exp",
    "from_axis_angle",
    "from_rotation",
    "log",
    "normalized",
    "product",
    "rate",
    "rate_in_body",
    "relative",
    "to_rotation",
]

# A quaternion given with seven digits passes, one given with three does not.
UNIT_TOLERANCE = 1e-6


@compilable
def product(A: Array, B: Array) -> Array:
    """The quaternion A * B (4,) of the rotation R(A) R(B)."""
    aw, ax, ay, az = wxyz(A)
    bw, bx, by, bz = wxyz(B)
    return vector(
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


@compilable
def conjugate(Q: Array) -> Array:
    """The quaternion {η, −ε} (4,) of the inverse rotation."""
    w, x, y, z = wxyz(Q)
    return vector(w, -x, -y, -z)


@compilable
def canonical(Q: Array) -> Array:
    """The one of Q and −Q (the same rotation) that has η ≥ 0."""
    return -Q if Q[0] < 0.0 else Q


@compilable
def relative(Q_WC: Array, Q_WD: Array) -> Array:
    """Q_CD = Q_WC⁻¹ * Q_WD = {η_dc, ᶜε_dc} (4,), the orientation of D seen from C, with η ≥ 0."""
    cw, cx, cy, cz = wxyz(Q_WC)
    dw, dx, dy, dz = wxyz(Q_WD)
    w = cw * dw + cx * dx + cy * dy + cz * dz
    x = cw * dx - cx * dw - cy * dz + cz * dy
    y = cw * dy + cx * dz - cy * dw - cz * dx
    z = cw * dz - cx * dy + cy * dx - cz * dw
    return vector(-w, -x, -y, -z) if w < 0.0 else vector(w, x, y, z)


@compilable
def to_rotation(Q: Array) -> Array:
    """The rotation matrix (3, 3) of the unit quaternion `Q`."""
    w, x, y, z = wxyz(Q)
    x2, y2, z2 = x + x, y + y, z + z
    xx, yy, zz = x * x2, y * y2, z * z2
    xy, xz, yz = x * y2, x * z2, y * z2
    wx, wy, wz = w * x2, w * y2, w * z2
    return matrix(
        (1.0 - yy - zz, xy - wz, xz + wy),
        (xy + wz, 1.0 - xx - zz, yz - wx),
        (xz - wy, yz + wx, 1.0 - xx - yy),
    )


@compilable
def from_rotation(R: Array) -> Array:
    """The unit quaternion (4,) of the rotation matrix `R`, with η ≥ 0.

    Four times one entry of Q, times Q itself, is a row without cancellation as long as that entry
    is the largest. The branch chooses that entry, so the result is accurate at every angle.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rows(R)
    trace = xx + yy + zz
    if trace >= max(xx, yy, zz):
        row = vector(1.0 + trace, zy - yz, xz - zx, yx - xy)
    elif xx >= max(yy, zz):
        row = vector(zy - yz, 1.0 + xx - yy - zz, xy + yx, xz + zx)
    elif yy >= zz:
        row = vector(xz - zx, xy + yx, 1.0 - xx + yy - zz, yz + zy)
    else:
        row = vector(yx - xy, xz + zx, yz + zy, 1.0 - xx - yy + zz)
    return canonical(normalized(row))


@compilable
def E(Q: Array) -> Array:
    """The matrix E = ηI − S(ε) (3, 3) of a quaternion: ε̇ = ½ E ω for ω in the base frame."""
    w, x, y, z = wxyz(Q)
    return matrix((w, z, -y), (-z, w, x), (y, -x, w))


@compilable
def rate(Q: Array, w: Array) -> Array:
    """Q̇ (4,) from the angular velocity `w` [rad/s] in the base frame: η̇ = −½εᵀω, ε̇ = ½Eω."""
    x, y, z = xyz(w)
    return 0.5 * product(vector(0.0, x, y, z), Q)


def angular_motion(Q: Array, dQ: Array, ddQ: Array) -> tuple[Array, Array]:
    """Returns ω and ω̇ in the base frame from a quaternion of any norm, and its derivatives.

        ω = 2 vec(Q̇ * Q⁻¹),   ω̇ = 2 vec(Q̈ * Q⁻¹) − 2 (Q·Q̇)/‖Q‖² ω

    Args:
        Q: the quaternion (4,), not zero; Q/‖Q‖ is that of the rotation.
        dQ: Q̇ (4,).
        ddQ: Q̈ (4,).
    """
    inverse, square = conjugate(Q) / (Q @ Q), Q @ Q
    w = 2.0 * product(dQ, inverse)[1:]
    return w, 2.0 * product(ddQ, inverse)[1:] - 2.0 * (Q @ dQ) / square * w


@compilable
def rate_in_body(Q: Array, w: Array) -> Array:
    """Q̇ (4,) from the angular velocity `w` [rad/s] in the rotating frame: ε̇ = ½(ηI + S(ε))ω."""
    x, y, z = xyz(w)
    return 0.5 * product(Q, vector(0.0, x, y, z))


@compilable
def exp(rotvec: Array) -> Array:
    """The unit quaternion (4,) of the rotation vector ϑ r [rad] (3,)."""
    x, y, z = xyz(rotvec)
    t2 = x * x + y * y + z * z
    if t2 < 1e-4:
        # Series of cos(ϑ/2) and sin(ϑ/2)/ϑ: the square root has no derivative at zero.
        w = 1.0 - t2 * (1.0 - t2 / 48.0) / 8.0
        k = 0.5 - t2 * (1.0 - t2 / 80.0) / 48.0
    else:
        theta = np.sqrt(t2)
        w, k = np.cos(0.5 * theta), np.sin(0.5 * theta) / theta
    return vector(w, k * x, k * y, k * z)


@compilable
def angle_over_sine(eta: float, s2: float) -> float:
    """ϑ / sin(ϑ/2), 2 at ϑ = 0, from η = cos(ϑ/2) ≥ 0 and s2 = sin²(ϑ/2)."""
    if s2 < 1e-4:
        return 2.0 + s2 * (1.0 / 3.0 + s2 * (3.0 / 20.0 + s2 * (5.0 / 56.0)))
    s = np.sqrt(s2)
    return 2.0 * np.arctan2(s, eta) / s


@compilable
def log(Q: Array) -> Array:
    """The rotation vector ϑ r [rad] (3,) of the unit quaternion `Q`, with 0 ≤ ϑ ≤ π."""
    w, x, y, z = wxyz(canonical(Q))
    k = angle_over_sine(w, x * x + y * y + z * z)
    return vector(k * x, k * y, k * z)


@compilable
def from_axis_angle(axis: Array, angle: float) -> Array:
    """The unit quaternion (4,) of the rotation by `angle` [rad] about the unit vector `axis`."""
    x, y, z = xyz(axis)
    s = np.sin(0.5 * angle)
    return vector(np.cos(0.5 * angle), s * x, s * y, s * z)


@compilable
def normalized(Q: Array) -> Array:
    """Q / ‖Q‖."""
    return Q / np.sqrt(Q @ Q)


def check_unit(Q: Array, name: str) -> None:
    """Refuses a quaternion that is not a unit one; floats only.

    Raises:
        SignalError: the norm of `Q` differs from 1 by more than 1e-6, or is not finite.
    """
    norm = float(np.sqrt(Q @ Q))
    if not abs(norm - 1.0) <= UNIT_TOLERANCE:  # written so that NaN fails, too
        raise SignalError(
            f"{name} is not a unit quaternion: its norm is {norm:.9g}, not 1 within "
            f"{UNIT_TOLERANCE:g}. Give [w, x, y, z], normalized."
        )
