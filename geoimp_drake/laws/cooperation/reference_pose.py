"""Where the hands have to be for the object to be at C: the inverse of (4.1), (4.4), (4.7), (4.8).

Frames: C compliant, where O has to be; 1 and 2 the end effectors' references.
"""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.cooperation.half_rotation import half_rotation
from geoimp_drake.rotations.quaternion import conjugate, product
from geoimp_drake.typing import Array

__all__ = [
    "reference_orientation_1",
    "reference_orientation_2",
    "reference_position_1",
    "reference_position_2",
]


@compilable
def reference_position_1(p_WC: Array, p_12_W: Array) -> Array:
    """(4.10) p_r1 = p_c − ½ Δp_r21 (3,), in W [m]."""
    return p_WC - 0.5 * p_12_W


@compilable
def reference_position_2(p_WC: Array, p_12_W: Array) -> Array:
    """(4.11) p_r2 = p_c + ½ Δp_r21 (3,), in W [m]."""
    return p_WC + 0.5 * p_12_W


@compilable
def reference_orientation_1(Q_WC: Array, Q_12: Array) -> Array:
    """(4.12) Q_r1 = Q_c * {cos(ϑ_r21/4), −sin(ϑ_r21/4) ¹r_r21} (4,), with ¹Q_r21 = `Q_12` (4,)."""
    return product(Q_WC, conjugate(half_rotation(Q_12)))


@compilable
def reference_orientation_2(Q_W1: Array, Q_12: Array) -> Array:
    """(4.13) Q_r2 = Q_r1 * ¹Q_r21 (4,)."""
    return product(Q_W1, Q_12)
