"""How the hands have to move for the object to move as C does.

Spatial vectors are [angular; linear], in W.
"""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import joined, vector
from geoimp_drake.rotations.so3 import cross
from geoimp_drake.typing import Array

__all__ = [
    "reference_velocity_1",
    "reference_velocity_2",
    "rigid_mutual_acceleration",
    "rigid_mutual_velocity",
]


@compilable
def reference_velocity_1(V_WC: Array, V_21: Array) -> Array:
    """(4.14) v_r1 = v_c − ½ Δv_r21 (6,); with accelerations, its derivative."""
    return V_WC - 0.5 * V_21


@compilable
def reference_velocity_2(V_WC: Array, V_21: Array) -> Array:
    """(4.15) v_r2 = v_c + ½ Δv_r21 (6,); with accelerations, its derivative."""
    return V_WC + 0.5 * V_21


@compilable
def rigid_mutual_velocity(w_WC: Array, p_12_W: Array) -> Array:
    """Returns Δv_r21 = [0; ω_c × Δp_r21] (6,) of a mutual pose that is constant in C.

    With a Δp_r21 that is constant in W, and Δv_r21 = 0, the grasp would open as C turns.
    """
    return joined(vector(0.0, 0.0, 0.0), cross(w_WC, p_12_W))


@compilable
def rigid_mutual_acceleration(w_WC: Array, dw_WC: Array, p_12_W: Array) -> Array:
    """Returns Δv̇_r21 = [0; ω̇_c × Δp + ω_c × (ω_c × Δp)] (6,), the derivative of the velocity.

    Args:
        w_WC: angular velocity of C (3,), in W [rad/s].
        dw_WC: its angular acceleration (3,), in W [rad/s²].
        p_12_W: Δp_r21 (3,), in W [m], constant in C.
    """
    linear = cross(dw_WC, p_12_W) + cross(w_WC, cross(w_WC, p_12_W))
    return joined(vector(0.0, 0.0, 0.0), linear)
