"""Known friction, fed forward along the desired motion.

H. Olsson et al., "Friction models and friction compensation", European Journal of Control (1998).
The velocity is that of the reference, since an arm that sticks has none. The sign of the velocity
is smoothed. Floats only.
"""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import stored
from geoimp_drake.typing import Array

__all__ = ["followed_velocity", "friction_torque"]


@compilable
def followed_velocity(J_pinv: Array, v: Array, V_WE: Array, reference: Array) -> Array:
    """Returns q̇ + J†(V_c − V_e) (n,): the hand moves as C, with the null-space motion of q̇.

    Args:
        J_pinv: J† (n, 6).
        v: joint velocities (n,).
        V_WE: velocity of E [angular; linear] (6,), in W.
        reference: V_c (6,), in W.
    """
    return v + stored(J_pinv) @ (reference - V_WE)


@compilable
def friction_torque(v: Array, coulomb: Array, viscous: Array, slow: float) -> Array:
    """(R.2) τ_F = F_c tanh(q̇_c / v_s) + F_v q̇_c (n,).

    Args:
        v: q̇_c, of `followed_velocity` (n,).
        coulomb: F_c (n,) [Nm, N].
        viscous: F_v, beyond what the model has (n,) [Nms/rad, Ns/m].
        slow: v_s, below which the sign is uncertain [rad/s, m/s].
    """
    return coulomb * np.tanh(v / slow) + viscous * v
