"""The wrench that two hands exert on the object, about its origin.

Wrenches are [moment; force], by the end effector on the environment, in W.
"""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import joined
from geoimp_drake.laws.sensing.sensed_wrench import shifted_moment
from geoimp_drake.rotations.so3 import skew
from geoimp_drake.typing import Array

__all__ = ["grasp_matrix", "object_wrench", "printed_object_wrench"]


@compilable
def printed_object_wrench(h_1: Array, h_2: Array) -> Array:
    """(4.6) h_o = h_1 + h_2 (6,), each moment about its own hand [Nm, N].

    It has no lever arms, and is dual to (4.5) as printed. It is the wrench about O only as far as
    the moments of the hands' forces about O cancel.
    """
    return h_1 + h_2


@compilable
def object_wrench(h_1: Array, h_2: Array, p_O1: Array, p_O2: Array) -> Array:
    """(4.6) with lever arms: f_o = Σ f_k, μ_o = Σ (μ_k + (p_k − p_o) × f_k) (6,) [Nm, N].

    Args:
        h_1: wrench of the first hand (6,), about its own origin, in W.
        h_2: the same of the second (6,).
        p_O1: p_1 − p_o (3,), in W [m].
        p_O2: p_2 − p_o (3,), in W [m].
    """
    moment = shifted_moment(h_1[:3], h_1[3:], -p_O1) + shifted_moment(h_2[:3], h_2[3:], -p_O2)
    return joined(moment, h_1[3:] + h_2[3:])


def grasp_matrix(p_O1: Array, p_O2: Array) -> Array:
    """(4.6) The matrix W (6, 12) of `object_wrench`: h_o = W [h_1; h_2].

    Args:
        p_O1: p_1 − p_o (3,), in W [m].
        p_O2: p_2 − p_o (3,), in W [m].
    """
    eye, zero = np.eye(3), np.zeros((3, 3))
    return np.block([[eye, skew(p_O1), eye, skew(p_O2)], [zero, eye, zero, eye]])
