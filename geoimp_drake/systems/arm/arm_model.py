"""One evaluation of the arm per step: kinematics and dynamics for every block that needs them."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, ValueProducer

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.dynamics import arm_dynamics
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.parts.signals import check_signal
from geoimp_drake.systems.frame_motion import (
    ACCELERATION,
    POSITION,
    QUATERNION,
    VELOCITY,
    frame_motion_vector,
)
from geoimp_drake.systems.part_system import Block

__all__ = ["ArmModel"]


class ArmModel(Block):
    """Evaluates the control model of an arm once for each state that it is given.

    Ports:
        input state: [q; v] of the model instance, in its own order (2n)
        output arm: ArmState, in the control model's joint order, until it is evaluated again
        output motion_E: the measured motion of E in W; accelerations are not measured: zero (19)
    """

    def __init__(self, model: ControlModel):
        super().__init__()
        self._model = model
        self._dynamics, self._is_finite = arm_dynamics(model), compiled(is_finite)
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
        if not self._is_finite(state):
            check_signal(state, f"{self.get_name()}:state")
        scratch, ordered = self._scratch.Eval(context), state[self._model.state_order]
        output.set_value(self._dynamics.evaluate(scratch, ordered))

    def _calc_motion(self, context: Context, output: BasicVector) -> None:
        arm, motion = self._arm.Eval(context), output.get_mutable_value()
        motion[QUATERNION] = arm.Q_WE
        motion[POSITION] = arm.p_WE
        motion[VELOCITY] = arm.V_WE
        motion[ACCELERATION] = 0.0
