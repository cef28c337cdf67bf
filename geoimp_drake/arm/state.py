"""The state of an arm at one instant, as the laws need it, evaluated by Drake."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.framework import Context

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.rotations import quaternion
from geoimp_drake.typing import Array

__all__ = ["ArmState", "evaluate_arm"]

_ORIGIN = np.zeros(3)
_WRT_V = JacobianWrtVariable.kV


@dataclass(slots=True)
class ArmState:
    """An arm at one instant, for the laws; all in W, spatial vectors [angular; linear].

    Frames: E the end effector, W the world.
    """

    q: Array  # (n) joint positions [rad or m]
    v: Array  # (n) joint velocities
    Q_WE: Array  # (4) orientation of E, quaternion
    R_WE: Array  # (3×3) orientation of E
    p_WE: Array  # (3) position of E's origin [m]
    V_WE: Array  # (6) velocity of E
    Jv_V_WE: Array  # (6×n) geometric Jacobian: V_WE = J v  (2.1)
    Jdot_v: Array  # (6) J̇ v
    B: Array  # (n×n) inertia matrix, reflected rotor inertia included  (2.2)
    Cv: Array  # (n) Coriolis and centrifugal torques
    Fv: Array  # (n) viscous friction torques
    g: Array  # (n) torques that hold the arm against gravity
    chain: Any = None  # further results of `dynamics.ChainDynamics`


def evaluate_arm(
    model: ControlModel,
    scratch: Context,
    state: Array,
    from_rotation: Callable[[Array], Array] = quaternion.from_rotation,
) -> ArmState:
    """Returns the arm's kinematics and dynamics at [q; v] in the control model's order.

    Args:
        model: the arm.
        scratch: a context of the model's plant; it is left at the state.
        state: [q; v] (2n,).
        from_rotation: the quaternion of a rotation matrix; compiled, it is faster.
    """
    plant, E, W = model.plant, model.end_effector, model.world
    n = model.num_joints
    plant.SetPositionsAndVelocities(scratch, state)
    X_WE = E.CalcPoseInWorld(scratch).GetAsMatrix34()
    R_WE = X_WE[:, :3].copy()
    J = plant.CalcJacobianSpatialVelocity(scratch, _WRT_V, E, _ORIGIN, W, W)
    bias = plant.CalcBiasSpatialAcceleration(scratch, _WRT_V, E, _ORIGIN, W, W)
    v = state[n:]
    return ArmState(
        q=state[:n],
        v=v,
        Q_WE=from_rotation(R_WE),
        R_WE=R_WE,
        p_WE=X_WE[:, 3].copy(),
        V_WE=J @ v,
        Jv_V_WE=J,
        Jdot_v=bias.get_coeffs(),
        B=plant.CalcMassMatrix(scratch),
        Cv=plant.CalcBiasTerm(scratch),
        Fv=model.viscous_friction * v,
        g=-plant.CalcGravityGeneralizedForces(scratch),
    )
