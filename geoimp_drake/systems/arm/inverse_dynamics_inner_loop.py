"""Inverse dynamics: joint torques that make the arm a set of double integrators."""

import logging

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, State

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.motion_control.inverse_dynamics import actuation, peak_effort
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.frame_motion import check_signal
from geoimp_drake.typing import Array

__all__ = ["InverseDynamicsInnerLoop", "report_saturation"]

_log = logging.getLogger("drake")


class InverseDynamicsInnerLoop(Block):
    """Computes the driving torques (2.3) τ = Bα + Cq̇ + Fq̇ + g + Jᵀh, giving (2.4) q̈ = α.

    The torques are not limited here: Drake's actuators clamp at their effort limits, and this
    system says so the first time that a torque exceeds its joint's limit.

    Args:
        model: the arm's control model.
        period: how often the torques are compared with the limits [s].

    Raises:
        SignalError: an input is NaN or infinite.

    Ports:
        input joint_acceleration: α (n) [rad/s² or m/s²]
        input arm: ArmState
        input wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6)
        output actuation: τ in the order of the model instance's actuators (n) [Nm or N]
        output peak_effort: largest torque since the start as a fraction of the limit (n)
    """

    def __init__(self, model: ControlModel, period: float = 1e-3):
        super().__init__()
        self._model = model
        self._limits = model.effort_limits[model.actuation_order]
        self._law, self._peak_effort = compiled(actuation), compiled(peak_effort)
        n = model.num_joints
        self._alpha = self.DeclareVectorInputPort("joint_acceleration", n)
        self._arm = self.DeclareAbstractInputPort("arm", AbstractValue.Make(object()))
        self._wrench = self.DeclareVectorInputPort("wrench", 6)
        peak = self.declare_state(n)
        inputs = {
            self.input_port_ticket(port.get_index())
            for port in (self._alpha, self._arm, self._wrench)
        }
        self._torque = self.DeclareVectorOutputPort("actuation", n, self._calc_torque, inputs)
        self.declare_state_output("peak_effort", peak)
        # Unrestricted updates come first, as a plant's step with sampled output ports does: the
        # torque compared is the one that the step uses, and is not computed again.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._compare_with_limits)

    def _calc_torque(self, context: Context, output: BasicVector) -> None:
        arm, h = self._arm.Eval(context), self._wrench.Eval(context)
        alpha = self._alpha.Eval(context)
        order, u = self._model.actuation_order, output.get_mutable_value()
        if not self._law(arm.B, alpha, arm.Cv, arm.Fv, arm.g, arm.Jv_V_WE, h, order, u):
            check_signal(h, f"{self.get_name()}:wrench")
            check_signal(alpha, f"{self.get_name()}:joint_acceleration")

    def _compare_with_limits(self, context: Context, state: State) -> None:
        torque = self._torque.Eval(context)
        before = context.get_discrete_state_vector().value()
        peak = state.get_mutable_discrete_state().get_mutable_value()
        if self._peak_effort(torque, self._limits, before, peak):
            new = np.flatnonzero((before <= 1) & (peak > 1))
            report_saturation(self.get_name(), self._model, context.get_time(), torque, new)


def report_saturation(
    system: str, model: ControlModel, time: float, torque: Array, actuators: Array
) -> None:
    """Logs a warning for each actuator that is asked for more than its limit.

    Args:
        system: name of the system that asks.
        model: the arm.
        time: when [s].
        torque: asked for, in the order of the actuators (n,) [Nm, N].
        actuators: which of them are to be reported.
    """
    for i in actuators:
        joint = model.actuation_order[i]
        _log.warning(
            f"{system}: joint '{model.joint_names[joint]}' saturates at t = {time:.3f} s: "
            f"{torque[i]:.1f} asked, the limit is ±{model.effort_limits[joint]:g}; the plant "
            f"clamps it."
        )
