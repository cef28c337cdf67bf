"""One evaluation of the arm per step: kinematics and dynamics for every block that needs them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.framework import BasicVector, Context, ValueProducer

from geoimp_drake.compiled import compiled
from geoimp_drake.control_model import ControlModel
from geoimp_drake.laws.motion_vector import is_finite
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.frame_motion import (
    FRAME_MOTION_SIZE,
    POSITION,
    QUATERNION,
    VELOCITY,
    check_signal,
    frame_motion_vector,
)
from geoimp_drake.typing import Array

__all__ = ["ArmModel", "ArmState", "evaluate_arm"]

_ORIGIN = np.zeros(3)
_WRT_V = JacobianWrtVariable.kV


@dataclass(slots=True)
class ArmState:
    """What the laws need of an arm at one instant; all in W, spatial vectors [angular; linear].

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


class ArmModel(Block):
    """Evaluates the control model of an arm once for each state that it is given.

    Ports:
        input state: [q; v] of the model instance, in its own order (2n)
        output arm: ArmState, in the control model's joint order
        output motion_E: the measured motion of E in W; accelerations are not measured: zero (19)
    """

    def __init__(self, model: ControlModel):
        super().__init__()
        self._model = model
        self._from_rotation = compiled(quaternion.from_rotation)
        n = model.num_joints
        self._state = self.DeclareVectorInputPort("state", 2 * n)
        self._scratch = self.DeclareCacheEntry(
            "scratch context of the control model",
            ValueProducer(
                lambda: AbstractValue.Make(model.plant.CreateDefaultContext()),
                lambda context, value: None,
            ),
            {self.nothing_ticket()},
        )
        self._arm = self.DeclareAbstractOutputPort(
            "arm",
            lambda: AbstractValue.Make(object()),
            self._calc_arm,
            {self.input_port_ticket(self._state.get_index())},
        )
        self.DeclareVectorOutputPort(
            "motion_E",
            frame_motion_vector(),
            self._calc_motion,
            {self.input_port_ticket(self._state.get_index())},
        )

    @property
    def model(self) -> ControlModel:
        """The control model that is evaluated."""
        return self._model

    def _calc_arm(self, context: Context, output: AbstractValue) -> None:
        state = self._state.Eval(context)
        if not is_finite(state):
            check_signal(state, f"{self.get_name()}:state")
        ordered, scratch = state[self._model.state_order], self._scratch.Eval(context)
        # A step of the plant makes Drake ask again for a state that has been evaluated already.
        if not _is_at(output.get_value(), ordered):
            output.set_value(evaluate_arm(self._model, scratch, ordered, self._from_rotation))

    def _calc_motion(self, context: Context, output: BasicVector) -> None:
        arm = self._arm.Eval(context)
        motion = np.zeros(FRAME_MOTION_SIZE)
        motion[QUATERNION] = arm.Q_WE
        motion[POSITION] = arm.p_WE
        motion[VELOCITY] = arm.V_WE
        output.SetFromVector(motion)


def _is_at(arm: object, state: Array) -> bool:
    """Whether an arm has been evaluated at [q; v]; before the first time it is no arm at all."""
    return isinstance(arm, ArmState) and arm.q.tobytes() + arm.v.tobytes() == state.tobytes()


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
