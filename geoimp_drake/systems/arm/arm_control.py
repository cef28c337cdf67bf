"""The inner loop of one arm as one system: the blocks of that loop, sooner."""

from collections.abc import Callable

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, State

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.systems.arm.arm_loop import ArmBlocks, ArmLoop
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.declaring import declare_cache, tickets_of
from geoimp_drake.systems.frame_motion import frame_motion_vector
from geoimp_drake.typing import Array

__all__ = ["ArmControl"]


class ArmControl(Block):
    """Makes the end effector of an arm track a reference motion: five blocks as one system.

    It does what these do, connected one after the other, with the same laws and the same numbers,
    in one compiled call a step (laws/arm_torque.py):

        VelocityEstimator ─▶ ArmModel ─▶ MotionController ─▶ RedundancyResolver
                                                          ─▶ InverseDynamicsInnerLoop

    Kinematics and dynamics are those of laws/serial_chain.py in the place of Drake's.

    Args:
        blocks: whose work it does.

    Raises:
        SignalError: an input is NaN or infinite, or the reference's quaternion is not unit.
        SingularityError: six joints in an exactly singular posture.

    Ports:
        input estimated_state: [q; v] of the model instance, in its own order (2n)
        input reference_motion: of the frame to be tracked, in W (19)
        input wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6)
        output actuation: τ in the order of the model instance's actuators (n) [Nm or N]
        output measured_motion: of E in W as the joint readings tell; accelerations are zero (19)
        output peak_effort: largest torque since the start as a fraction of the limit (n)
        output smallest_singular_value: of J, in rad and m (1)
        output null_space_error: e_n, zero for six joints (n)
        output task_value: w (1)
    """

    def __init__(self, blocks: ArmBlocks):
        super().__init__()
        n = blocks.model.num_joints
        self._arm = ArmLoop(self, blocks)
        self._state = self.DeclareVectorInputPort("estimated_state", 2 * n)
        self._reference = self.DeclareVectorInputPort("reference_motion", frame_motion_vector())
        self._wrench = self.DeclareVectorInputPort("wrench", 6)
        self._memory = self.declare_state(self._arm.memory_at_start)
        self._peak = self.declare_state(n)
        self._declare_events(blocks.readings.period)
        self._declare_outputs(n)

    def _declare_events(self, period: float) -> None:
        self.DeclareInitializationDiscreteUpdateEvent(self._first_reading)
        # Without offset, so that its instants are those of the plant's steps to the last bit.
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._next_reading)
        # Unrestricted updates come first, as a plant's step with sampled output ports does: the
        # torque compared is the one that the step uses, and is not computed again.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._compare_with_limits)

    def _declare_outputs(self, n: int) -> None:
        reading = {self.ticket_of_state(self._memory)} | tickets_of(self, self._state)
        law = reading | tickets_of(self, self._reference, self._wrench)
        if self._arm.is_redundant:
            law |= {self.time_ticket()}
        self._torque = self.DeclareVectorOutputPort("actuation", n, self._calc_torque, law)
        self.DeclareVectorOutputPort(
            "measured_motion", frame_motion_vector(), self._calc_measured_motion, reading
        )
        self.declare_state_output("peak_effort", self._peak)
        # Of six joints it says how near a singularity is, where there may be no torque.
        tickets = law if self._arm.is_redundant else reading
        self._reported = declare_cache(self, "internal motion", self._calc_report, tickets)
        report = {self._reported.ticket()}
        for k, (name, size) in enumerate(
            (("smallest_singular_value", 1), ("null_space_error", n), ("task_value", 1))
        ):
            self.DeclareVectorOutputPort(name, size, self._part_of_report(k), report)

    @property
    def model(self) -> ControlModel:
        """The arm's control model."""
        return self._arm.model

    def _first_reading(self, context: Context, state: DiscreteValues) -> None:
        # Drake hands over a copy of the context's state.
        self._arm.take_first(state.get_mutable_value(self._memory), self._state.Eval(context))

    def _next_reading(self, context: Context, state: DiscreteValues) -> None:
        self._arm.take_next(state.get_mutable_value(self._memory), self._state.Eval(context))

    def _compare_with_limits(self, context: Context, state: State) -> None:
        peak = state.get_mutable_discrete_state(self._peak).get_mutable_value()
        self._arm.compare_with_limits(context, self._torque.Eval(context), self._peak, peak)

    def _remembered(self, context: Context) -> Array:
        """Returns the arm's memory; before the first reading the port's passes through."""
        # A copy: a law is compiled once more for an array that cannot be written to.
        memory: Array = context.get_discrete_state(self._memory).CopyToVector()
        if not self._arm.has_reading(memory):
            self._arm.pass_through(memory, self._state.Eval(context))
        return memory

    def _calc_measured_motion(self, context: Context, output: BasicVector) -> None:
        self._arm.write_motion(self._remembered(context), output.get_mutable_value())

    def _calc_torque(self, context: Context, output: BasicVector) -> None:
        self._write_torque(context, self._remembered(context), output.get_mutable_value())

    def _write_torque(self, context: Context, memory: Array, u: Array) -> tuple[Array, float]:
        """Writes the torques; returns e_n and w."""
        reference, wrench = self._reference.Eval(context), self._wrench.Eval(context)
        return self._arm.write_torque(context, memory, reference, wrench, u)

    def _calc_report(self, context: Context, value: AbstractValue) -> None:
        memory, error, w = self._remembered(context), np.zeros(self.model.num_joints), 0.0
        if self._arm.is_redundant:
            error, w = self._write_torque(context, memory, np.empty_like(error))
        sigma = self._arm.smallest_singular_value(memory)
        value.set_value((np.array([sigma]), error, np.array([w])))

    def _part_of_report(self, k: int) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(self._reported.Eval(context)[k])

        return calc
