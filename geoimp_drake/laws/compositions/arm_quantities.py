"""Kinematics and dynamics of an arm in one call: (2.1), (2.2) and what follows from them.

`*arm` are the fields of a `serial_chain.ChainArrays`, passed one by one because that is faster for
a compiled law. A reading holds [q; v] in the order of the arm's plant; `order` (2n,) has the place
of each entry.
Floats only.
"""

from geoimp_drake.compilation.small_arrays import sized
from geoimp_drake.laws.dynamics.serial_chain import (
    ChainArrays,
    chain_dynamics,
    chain_motion,
    chain_posture,
)
from geoimp_drake.laws.frame_motion import POSITION, QUATERNION, VELOCITY, is_finite
from geoimp_drake.rotations.quaternion import from_rotation
from geoimp_drake.typing import Array

__all__ = ["arm_quantities", "measured_motion"]


def measured_motion(order: Array, reading: Array, motion: Array, *arm: Array) -> bool:
    """Writes the motion of E (19,) that follows from a reading, with zero accelerations.

    Returns False if the reading is not finite.

    Args:
        order: of the reading (2n,).
        reading: at least (2n,) [rad, m; rad/s, m/s].
        motion: where to write.
        arm: its constants.
    """
    x, n = reading[order], len(order) // 2
    if not is_finite(x):
        return False
    s, _, X_WE = chain_posture(ChainArrays(*arm), x[:n])
    motion[:] = 0.0
    motion[QUATERNION] = from_rotation(X_WE[:, :3])
    motion[POSITION] = sized(X_WE[:, 3], 3)
    motion[VELOCITY] = sized(chain_motion(s, x[n:], X_WE[:, 3])[1], 6)
    return True


def arm_quantities(q: Array, v: Array, *arm: Array) -> tuple[Array, ...]:
    """Returns Q_WE, R_WE, p_WE, V_WE, J, J̇q̇, B, Cq̇, Fq̇ and g of (2.1), (2.2).

    Behind them follow Ḃ and, for `chain_coriolis`, the joints' axes and the links' inertias.

    Args:
        q: joint positions (n,) [rad, m].
        v: joint velocities (n,).
        arm: its constants.
    """
    chain = ChainArrays(*arm)
    s, links, X_WE = chain_posture(chain, q)
    R_WE, p_WE = X_WE[:, :3].copy(), X_WE[:, 3].copy()
    J, V_WE, Jdot_v = chain_motion(s, v, p_WE)
    B, dB, Cv, g = chain_dynamics(chain, s, links, v)
    Q_WE, Fv = from_rotation(R_WE), chain.friction * v
    return Q_WE, R_WE, p_WE, V_WE, J, Jdot_v, B, Cv, Fv, g, dB, s, links
