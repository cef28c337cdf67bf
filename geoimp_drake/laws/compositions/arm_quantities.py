"""Kinematics and dynamics of an arm in one call: (2.1), (2.2) and what follows from them.

A reading holds [q; v] in the order of the arm's plant. `order` (2n,) has the places in it of the
joints' [q; v] from base to hand. Floats only.
"""

from geoimp_drake.compilation.small_arrays import sized
from geoimp_drake.laws.dynamics.serial_chain import (
    ChainArrays,
    ChainValues,
    chain_dynamics,
    chain_motion,
    chain_posture,
    chain_state,
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
        found: memory for its quantities.
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


def arm_quantities(
    arm: ChainArrays, found: ChainValues, Q_WE: Array, R_WE: Array, p_WE: Array, Fv: Array
) -> None:
    """Writes the results of the chain's laws, and Q_WE, R_WE, p_WE and Fq̇ of (2.1), (2.2).

    Args:
        arm: its constants.
        found: holds joint positions and velocities; where to write the rest.
        Q_WE: where to write (4,), like all that follow.
        R_WE: see there (3, 3).
        p_WE: see there (3,).
        Fv: see there (n,).
    """
    n = len(Fv)
    q, v = found.x[:n], found.x[n:]
    chain_posture(arm, q, found)
    chain_motion(v, found)
    chain_dynamics(arm, v, found)
    R_WE[:] = found.X_WE[:, :3]
    p_WE[:] = found.X_WE[:, 3]
    Q_WE[QUATERNION] = from_rotation(R_WE)
    Fv[:] = arm.friction * v
