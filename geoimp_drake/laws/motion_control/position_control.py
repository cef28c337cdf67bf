"""Position control of the end effector."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.typing import Array

__all__ = ["position_acceleration"]


@compilable
def position_acceleration(
    ddp_d: Array, dp_error: Array, p_error: Array, K_D: Array, K_P: Array
) -> Array:
    """(2.9) a_p = p̈_d + K_Dp Δṗ_de + K_Pp Δp_de, everything in W.

    The error obeys Δp̈ + K_Dp Δṗ + K_Pp Δp = 0.

    Args:
        ddp_d: acceleration of D's origin (3,) [m/s²].
        dp_error: Δṗ_de = ṗ_d − ṗ_e (3,) [m/s].
        p_error: Δp_de = p_d − p_e (3,) [m].
        K_D: gain (3, 3) [1/s].
        K_P: gain (3, 3) [1/s²].

    Returns:
        a_p (3,) [m/s²].
    """
    return ddp_d + K_D @ dp_error + K_P @ p_error
