"""The velocity of the second hand relative to the first, in W and in the mutual pose's frames."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.rotations.so3 import cross
from geoimp_drake.typing import Array

__all__ = ["mutual_angular_velocity", "mutual_linear_velocity", "mutual_velocity"]


@compilable
def mutual_velocity(V_W1: Array, V_W2: Array) -> Array:
    """(4.9) Δv_21 = v_2 − v_1 (6,), [angular; linear], in W [rad/s, m/s]."""
    return V_W2 - V_W1


@compilable
def mutual_angular_velocity(R_W1: Array, w_21_W: Array) -> Array:
    """(4.9) ¹ω_21 = R_1ᵀ Δω_21 (3,), in the first hand [rad/s]: that of ¹Q_21 (4.8)."""
    return R_W1.T @ w_21_W


@compilable
def mutual_linear_velocity(R_WO: Array, w_WO: Array, p_12_W: Array, v_21_W: Array) -> Array:
    """(4.9) d(ᵒΔp_21)/dt = R_oᵀ(Δṗ_21 − ω_o × Δp_21) (3,), of the components in O [m/s].

    Args:
        R_WO: orientation of the object (3, 3).
        w_WO: its angular velocity (3,), in W [rad/s].
        p_12_W: Δp_21 (3,), in W [m].
        v_21_W: Δṗ_21 (3,), in W [m/s].
    """
    return R_WO.T @ (v_21_W - cross(w_WO, p_12_W))
