"""Rotation matrices and the skew operator S(a)."""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import matrix, vector
from geoimp_drake.rotations import quaternion
from geoimp_drake.rotations.components import xyz
from geoimp_drake.typing import Array

__all__ = [
    "cross",
    "exp",
    "is_rotation",
    "log",
    "rotation_about",
    "skew",
    "vee",
    "x_rotation",
    "y_rotation",
    "z_rotation",
]


@compilable
def skew(a: Array) -> Array:
    """The matrix S(a) (3, 3) with S(a) b = a × b."""
    x, y, z = xyz(a)
    return matrix((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))


@compilable
def vee(S: Array) -> Array:
    """The vector a (3,) of the skew matrix S(a): the inverse of `skew`."""
    return vector(S[2, 1], S[0, 2], S[1, 0])


@compilable
def cross(a: Array, b: Array) -> Array:
    """A × b (3,), some twenty times faster than `numpy.cross` on two single vectors."""
    ax, ay, az = xyz(a)
    bx, by, bz = xyz(b)
    return vector(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)


@compilable
def exp(rotvec: Array) -> Array:
    """The rotation matrix (3, 3) of the rotation vector ϑ r [rad] (3,)."""
    return quaternion.to_rotation(quaternion.exp(rotvec))


@compilable
def log(R: Array) -> Array:
    """The rotation vector ϑ r [rad] (3,) of `R`, with 0 ≤ ϑ ≤ π: the inverse of `exp`."""
    return quaternion.log(quaternion.from_rotation(R))


@compilable
def rotation_about(axis: Array, angle: float) -> Array:
    """The rotation matrix (3, 3) by `angle` [rad] about the unit vector `axis` (3,)."""
    return quaternion.to_rotation(quaternion.from_axis_angle(axis, angle))


@compilable
def x_rotation(angle: float) -> Array:
    """Rx, the rotation by `angle` [rad] about the x axis."""
    c, s = np.cos(angle), np.sin(angle)
    return matrix((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c))


@compilable
def y_rotation(angle: float) -> Array:
    """Ry, the rotation by `angle` [rad] about the y axis."""
    c, s = np.cos(angle), np.sin(angle)
    return matrix((c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c))


@compilable
def z_rotation(angle: float) -> Array:
    """Rz, the rotation by `angle` [rad] about the z axis."""
    c, s = np.cos(angle), np.sin(angle)
    return matrix((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))


def is_rotation(R: Array, tol: float = 1e-9) -> bool:
    """Whether `R` is orthonormal and right-handed, each entry of RᵀR within `tol`; floats only."""
    if R.shape != (3, 3) or not np.isfinite(R).all():
        return False
    return bool(np.abs(R.T @ R - np.eye(3)).max() <= tol and np.linalg.det(R) > 0.0)
