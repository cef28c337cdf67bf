"""The pose of the second hand relative to the first.

Frames: 1 and 2 the end effectors, any frames fixed in the hands. Q and −Q are the same rotation,
but their halves differ by half a turn. O is turned from the first hand by such a half. So the sign
is chosen once, and from then on it is the one nearest to that choice. A positive sign would not do:
with hands that face each other, ϑ_21 = π, the axis ¹r_21 would flip with the slightest noise.
"""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.rotations.quaternion import conjugate, product
from geoimp_drake.typing import Array

__all__ = [
    "mutual_orientation",
    "mutual_orientation_at_start",
    "mutual_position",
    "mutual_rotation",
]

# Below this η (ϑ_21 above 168°) the sign of η is not clear of noise.
_UNCLEAR_ETA = 0.1


@compilable
def mutual_position(p_W1: Array, p_W2: Array) -> Array:
    """(4.7) Δp_21 = p_2 − p_1 (3,), in W [m]."""
    return p_W2 - p_W1


@compilable
def mutual_rotation(R_W1: Array, R_W2: Array) -> Array:
    """(4.3) ¹R_2 = R_1ᵀ R_2 (3, 3), the rotation by ϑ_21 about ¹r_21."""
    return R_W1.T @ R_W2


@compilable
def mutual_orientation(Q_W1: Array, Q_W2: Array, nearby: Array) -> Array:
    """(4.8) ¹Q_21 = Q_1⁻¹ * Q_2 (4,), with the sign nearest to a given one: ϑ_21 in [0, 2π).

    Args:
        Q_W1: orientation of the first hand (4,).
        Q_W2: orientation of the second hand (4,).
        nearby: ¹Q_21 at the start, or as prescribed (4,); the nearer one of ±¹Q_21 is returned.
    """
    Q_12 = product(conjugate(Q_W1), Q_W2)
    return -Q_12 if Q_12 @ nearby < 0.0 else Q_12


def mutual_orientation_at_start(Q_W1: Array, Q_W2: Array) -> Array:
    """(4.8) ¹Q_21 = Q_1⁻¹ * Q_2 (4,), with the sign that is kept from then on.

    ϑ_21 ≤ π, except for hands that nearly face each other (ϑ_21 > 168°). There the axis' entry of
    largest magnitude is positive, so that noise does not choose between ϑ_21 and 2π − ϑ_21.
    """
    Q_12 = product(conjugate(Q_W1), Q_W2)
    clear = abs(Q_12[0]) >= _UNCLEAR_ETA
    deciding = Q_12[0] if clear else Q_12[1 + int(np.argmax(np.abs(Q_12[1:])))]
    return -Q_12 if deciding < 0.0 else Q_12
