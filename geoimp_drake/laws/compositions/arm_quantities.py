"""Kinematics and dynamics of an arm in one call: (2.1), (2.2) and what follows from them.

A reading holds [q; v] in the order of the arm's plant; `order` (2n,) has the place
of each entry.
Floats only.
"""

from geoimp_drake.compilation.small_arrays import sized
from geoimp_drake.laws.dynamics.serial_chain import (
    ChainArrays,
    ChainValues,
    chain_dynamics,
    chain_motion,
    chain_posture,
    chain_state,
    chain_values,
)
from geoimp_drake.laws.frame_motion import POSITION, QUATERNION, VELOCITY, is_finite
from geoimp_drake.rotations.quaternion import from_rotation
from geoimp_drake.typing import Array

__all__ = ["arm_quantities", "measured_motion"]


def measured_motion(
    arm: ChainArrays, found: ChainValues, order: Array, reading: Array, motion: Array
) -> bool:
    """Writes the motion of E (19,) that follows from a reading, with zero accelerations.

    Returns False if the reading is not finite.

    Args:
        arm: its constants.
        found: memory for what is found of it.
        order: of the reading (2n,).
        reading: at least (2n,) [rad, m; rad/s, m/s].
        motion: where to write.
    """
    q, v = chain_state(order, reading, found)
    if not is_finite(found.x):
        return False
    chain_posture(arm, q, found)
    chain_motion(v, found)
    motion[:] = 0.0
    motion[QUATERNION] = from_rotation(found.X_WE[:, :3])
    motion[POSITION] = sized(found.X_WE[:, 3], 3)
    motion[VELOCITY] = sized(found.V_WE, 6)
    return True


def arm_quantities(arm: ChainArrays, x: Array) -> tuple[ChainValues, Array, Array, Array, Array]:
    """Returns what the laws of the chain find, and Q_WE, R_WE, p_WE and Fq̇ of (2.1), (2.2).

    Args:
        arm: its constants.
        x: joint positions and velocities (2n,) [rad, m; rad/s, m/s].
    """
    n = len(x) // 2
    found, q, v = chain_values(n), x[:n], x[n:]
    found.x[:] = x
    chain_posture(arm, q, found)
    chain_motion(v, found)
    chain_dynamics(arm, v, found)
    R_WE, p_WE = found.X_WE[:, :3].copy(), found.X_WE[:, 3].copy()
    return found, from_rotation(R_WE), R_WE, p_WE, arm.friction * v
