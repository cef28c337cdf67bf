"""One evaluation of the arm per step: kinematics and dynamics for every block that needs them."""

from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import (
    BasicVector,
    BasicVector_,
    Context,
    LeafSystem,
    LeafSystem_,
    ValueProducer,
)

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.dynamics import ArmDynamics, DrakeDynamics, arm_dynamics
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.parts.signals import AT_REST, check_signal
from geoimp_drake.systems.frame_motion import (
    ACCELERATION,
    FRAME_MOTION_SIZE,
    POSITION,
    QUATERNION,
    VELOCITY,
)
from geoimp_drake.systems.part_system import Block
from geoimp_drake.typing import Array

__all__ = ["ArmModel"]


class _ArmPorts(LeafSystem if TYPE_CHECKING else object):  # type: ignore[misc]
    """The ports of an arm model of any scalar; a model that has them has `_calc_motion`."""

    def _declare(self, model: ControlModel, dynamics: ArmDynamics, vector: Any) -> None:
        self._model, self._dynamics = model, dynamics
        self._is_finite = compiled(is_finite)
        n = model.num_joints
        self._state = self.DeclareVectorInputPort("state", 2 * n)
        self._scratch = self.DeclareCacheEntry(
            "where the arm is evaluated",
            ValueProducer(
                lambda: AbstractValue.Make(self._dynamics.new_scratch()),
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
            vector(AT_REST),
            self._calc_motion,
            {self.input_port_ticket(self._state.get_index())},
        )

    def _calc_arm(self, context: Context, output: AbstractValue) -> None:
        state = self._state.Eval(context)
        if not self._is_finite(state):
            check_signal(state, f"{self.get_name()}:state")
        scratch, ordered = self._scratch.Eval(context), state[self._model.state_order]
        output.set_value(self._dynamics.evaluate(scratch, ordered))

    def _write_motion(self, context: Context, motion: Array) -> None:
        arm = self._arm.Eval(context)
        motion[QUATERNION] = arm.Q_WE
        motion[POSITION] = arm.p_WE
        motion[VELOCITY] = arm.V_WE
        motion[ACCELERATION] = 0.0


class ArmModel(_ArmPorts, Block):
    """Evaluates the control model of an arm once for each state that it is given.

    Ports:
        input state: [q; v] of the model instance, in its own order (2n)
        output arm: ArmState, in the control model's joint order, valid until the next evaluation
        output motion_E: the measured motion of E in W; accelerations are not measured: zero (19)
    """

    def __init__(self, model: ControlModel):
        Block.__init__(self)
        self._declare(model, arm_dynamics(model), BasicVector)

    @property
    def model(self) -> ControlModel:
        """The control model that is evaluated."""
        return self._model

    def to_autodiff(self) -> Any:
        """Returns the same for `AutoDiffXd`."""
        return _AutoDiffArmModel(self._model.autodiff)

    def _calc_motion(self, context: Context, output: BasicVector) -> None:
        self._write_motion(context, output.get_mutable_value())


class _AutoDiffArmModel(_ArmPorts, LeafSystem_[AutoDiffXd]):
    """An arm model for `AutoDiffXd`, evaluated by Drake."""

    def __init__(self, model: ControlModel):
        LeafSystem_[AutoDiffXd].__init__(self)
        self._declare(model, DrakeDynamics(model), BasicVector_[AutoDiffXd])

    def _calc_motion(self, context: Any, output: Any) -> None:
        motion = np.empty(FRAME_MOTION_SIZE, object)
        self._write_motion(context, motion)
        output.SetFromVector(motion)
