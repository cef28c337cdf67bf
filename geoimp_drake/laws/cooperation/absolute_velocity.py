"""The velocity of an object that two hands hold."""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.rotations.so3 import cross
from geoimp_drake.typing import Array

__all__ = ["absolute_velocity", "moved_velocity"]


@compilable
def absolute_velocity(V_W1: Array, V_W2: Array) -> Array:
    """(4.5) v_o = ½(v_1 + v_2) (6,), [angular; linear], in W [rad/s, m/s].

    The linear half is the derivative of (4.1). The angular half is that of (4.4) if ¹r_21 is
    constant, as in a rigid grasp. Otherwise it exceeds that of (4.4) by (1 − cos(ϑ_21/2)) r × ṙ.
    Here r in O has the entries of ¹r_21, and ṙ is its rate of change in O.
    """
    return 0.5 * (V_W1 + V_W2)


def moved_velocity(V_Wk: Array, p_kO: Array) -> Array:
    """Returns the velocity (6,) of hand k as that of a body's point at O: v_k + ω_k × (p_o − p_k).

    Its mean over both hands is dual to the wrench with lever arms, as (4.5) is to (4.6) as printed;
    see `object_wrench`. For a rigid grasp the mean agrees with (4.5).

    Args:
        V_Wk: velocity of hand k (6,), [angular; linear], in W [rad/s, m/s].
        p_kO: p_o − p_k (3,), in W [m].
    """
    return np.concatenate((V_Wk[:3], V_Wk[3:] + cross(V_Wk[:3], p_kO)))
