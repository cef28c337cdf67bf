"""The pose of an object that two hands hold: halfway between them.

Frames: O the object; 1 and 2 the end effectors.
"""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.cooperation.half_rotation import half_rotation
from geoimp_drake.rotations.quaternion import product, to_rotation
from geoimp_drake.typing import Array

__all__ = ["absolute_orientation", "absolute_position", "absolute_rotation"]


@compilable
def absolute_position(p_W1: Array, p_W2: Array) -> Array:
    """(4.1) p_o = ½(p_1 + p_2) (3,), in W [m]."""
    return 0.5 * (p_W1 + p_W2)


@compilable
def absolute_orientation(Q_W1: Array, Q_12: Array) -> Array:
    """(4.4) Q_o = Q_1 * {cos(ϑ_21/4), sin(ϑ_21/4) ¹r_21} (4,), with ¹Q_21 = `Q_12` (4,)."""
    return product(Q_W1, half_rotation(Q_12))


@compilable
def absolute_rotation(R_W1: Array, Q_12: Array) -> Array:
    """(4.2) R_o = R_1 R(¹r_21, ϑ_21/2) (3, 3), with ¹Q_21 = `Q_12` (4,)."""
    return R_W1 @ to_rotation(half_rotation(Q_12))
