"""The whole controller of two arms that hold one object as one system: its blocks, sooner."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DependencyTicket,
    DiscreteValues,
    InputPort,
    State,
)

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.laws.compositions.object_control import HANDS
from geoimp_drake.systems.arm.arm_loop import ArmBlocks, ArmLoop
from geoimp_drake.systems.cooperation.object_control_base import (
    MEMORY_SIZE,
    Found,
    ObjectBlocks,
    ObjectControlBase,
)
from geoimp_drake.systems.declaring import declare_output, tickets_of
from geoimp_drake.systems.frame_motion import FRAME_MOTION_SIZE
from geoimp_drake.systems.sensing.hand_sensors import HandSensors
from geoimp_drake.systems.sensing.wrist_sensor_config import WristSensor
from geoimp_drake.typing import Array

__all__ = ["CooperativeControl"]


@dataclass(frozen=True, slots=True)
class _Arm:
    """One arm, and where in the state it has its part."""

    loop: ArmLoop
    state: InputPort
    place: slice  # of the loop's memory in the system's
    motion: slice  # of the hand's motion there
    peak: int  # the group of the largest torques


class CooperativeControl(ObjectControlBase):
    """Makes an object that two arms hold compliant: `ObjectControl` and an `ArmControl` for each.

    It does what these do, connected with each other, with the same laws and the same numbers, and
    with fewer calls from C++ into Python, each of which costs more than a law:

        ArmControl ── measured motions ─▶ ObjectControl ── references ─▶ ArmControl ─▶ actuation

    Args:
        blocks: of the object's part, whose work it does.
        arms: the blocks of both arms' inner loops; the readings of both are taken together.
        sensors: of both wrists, in order, read with the joints; none if the wrenches are inputs.

    Raises:
        ConfigurationError: a field of a sensor cannot be used.
        SignalError: an input is NaN or infinite, a quaternion is not unit, or C has diverged.
        OutOfDomainError: the hands have turned by more than 355° against each other.
        SingularityError: six joints in an exactly singular posture.

    Ports:
        input estimated_state_1: [q; v] of the first arm of n joints, in the plant's order (2n)
        input estimated_state_2: the same of the second (2n)
        input desired_motion: of D, the object's, in W (19)
        input stiffness_scale: factors of K_p and K_o, one each if not connected (2)
        input wrench_1: h = [μ; f] by the first hand on its environment, about Eo, in W (6)
        input wrench_2: the same by the second (6)
        output compliant_motion: of C, the object's, in W (19)
        output displacement: of D from C: [orientation displacement; Δp_dc] (6)
        output energy: energies and powers of the impedance, `ImpedanceEnergy` (9)
        output object_motion: of O in W as measured (19)
        output object_wrench: by the object on its environment, about Oo, in W (6)
        output internal_wrench: ½(h_2 − h_1), in W (6)
        output mutual_motion: the measured mutual pose, see `CooperativeKinematics` (19)
        output mutual_reference: the grasp's mutual pose ¹Q_21, ᵒΔp_21, at rest (19)
        output reference_motion_1: of the first hand in W (19)
        output reference_motion_2: of the second (19)
        output last_reference_motion_1: of the first hand when the last step began (19)
        output last_reference_motion_2: of the second (19)
        output opened: which grasps have opened, and when, see `GraspMonitor` (3)
        output release: which grippers are to open, see `ReferenceHold` (2)
        output actuation_1: torques in the order of the first arm's actuators (n) [Nm or N]
        output measured_motion_1: of the first hand as the readings tell; no accelerations (19)
        output peak_effort_1: largest torque so far as a fraction of the limit (n)
        output actuation_2: the same of the second (n)
        output measured_motion_2: the same of the second (19)
        output peak_effort_2: the same of the second (n)

        Without a watch there are no ports `opened` and `release`. With sensors, inputs for what the
        plant says (`reaction_forces` and `state`, or what else `ForceTorqueSensors` reads of it)
        take the place of `wrench_1` and `wrench_2`, there are outputs `wrench_1`, `wrench_true_1`,
        `peak_reading_1` and those of the second, and no `last_reference_motion_1` and `_2`.
    """

    def __init__(
        self, blocks: ObjectBlocks, arms: Sequence[ArmBlocks], sensors: Sequence[WristSensor] = ()
    ):
        super().__init__(blocks)
        # Behind the object's memory follow those of the arms and, held with their readings, the
        # motions of their hands.
        self._arms: list[_Arm] = []
        memory: list[Array] = []
        for k, arm in enumerate(arms, 1):
            loop = ArmLoop(self, arm, f"_{k}")
            port = self.DeclareVectorInputPort(f"estimated_state_{k}", 2 * loop.model.num_joints)
            start = MEMORY_SIZE + sum(map(len, memory))
            middle = start + len(loop.memory_at_start)
            places = slice(start, middle), slice(middle, middle + FRAME_MOTION_SIZE)
            peak = self.declare_state(loop.model.num_joints)
            self._arms.append(_Arm(loop, port, *places, peak))
            memory += [loop.memory_at_start, np.zeros(FRAME_MOTION_SIZE)]
        self._declare_object_inputs(wrenches=not sensors)
        self._sensors = None
        if sensors:
            self._sensors = HandSensors(self, sensors, MEMORY_SIZE + sum(map(len, memory)))
            memory.append(self._sensors.memory_at_start)
        self._declare_state(*memory, last_references=not sensors)
        self._declare_samples(arms[0].readings.period)
        self._declare_outputs(self._state_tickets())
        self._declare_arm_outputs()
        if self._sensors is not None:
            self._sensors.declare_outputs(self._memory)

    def _hand_wrenches(self, context: Context, memory: Array) -> tuple[Array, Array]:
        if self._sensors is None:
            return super()._hand_wrenches(context, memory)
        return self._sensors.wrenches(memory)

    def _keep_references(self, references: Array, memory: Array, discrete: DiscreteValues) -> None:
        if self._sensors is None:
            super()._keep_references(references, memory, discrete)
        else:
            self._sensors.keep_references(references, memory)

    def _memory_to_start_with(self, context: Context) -> Array:
        memory = super()._memory_to_start_with(context).copy()
        if self._sensors is not None:
            self._sensors.keep_measured(context.get_discrete_state(self._memory).value(), memory)
        return memory

    def _state_tickets(self) -> set[DependencyTicket]:
        return tickets_of(self, *(arm.state for arm in self._arms))

    def _declare_samples(self, period: float) -> None:
        self.DeclareInitializationDiscreteUpdateEvent(self._first_readings)
        # Without offset, so that its instants are those of the plant's steps to the last bit.
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._sample)
        # Unrestricted updates come first, as a plant's step with sampled output ports does: the
        # torques compared are those that the step uses, and are not computed again.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._compare_with_limits)

    def _declare_arm_outputs(self) -> None:
        reading = self._state_tickets() | {self.ticket_of_state(self._memory)}
        torque = self._law_tickets | {self.time_ticket()}
        self._torques = []
        for k, arm in enumerate(self._arms):
            n, calc = arm.loop.model.num_joints, partial(self._calc_torque, k)
            port = self.DeclareVectorOutputPort(f"actuation_{k + 1}", n, calc, torque)
            self._torques.append(port)
            motion = partial(self._measured_motion, k)
            declare_output(self, f"measured_motion_{k + 1}", FRAME_MOTION_SIZE, motion, reading)
            self.declare_state_output(f"peak_effort_{k + 1}", arm.peak)

    @property
    def models(self) -> list[ControlModel]:
        """The control models of both arms."""
        return [arm.loop.model for arm in self._arms]

    def _first_readings(self, context: Context, state: DiscreteValues) -> None:
        # Drake hands over a copy of the context's state.
        memory = state.get_mutable_value(self._memory)
        for arm in self._arms:
            arm.loop.take_first(memory[arm.place], arm.state.Eval(context))
        self._hold_motions(memory)

    def _sample(self, context: Context, state: DiscreteValues) -> None:
        memory = state.get_mutable_value(self._memory)
        for arm in self._arms:
            arm.loop.take_next(memory[arm.place], arm.state.Eval(context))
        self._hold_motions(memory)
        if self._watch is not None:
            self._watch_grasps(self._watch, context, state, memory)
        if self._sensors is not None:
            self._sensors.sample(context, self._memory, memory)

    def _hold_motions(self, memory: Array) -> None:
        for arm in self._arms:
            arm.loop.write_motion(memory[arm.place], memory[arm.motion])

    def _compare_with_limits(self, context: Context, state: State) -> None:
        discrete = state.get_mutable_discrete_state()
        for arm, port in zip(self._arms, self._torques, strict=True):
            peak = discrete.get_mutable_value(arm.peak)
            arm.loop.compare_with_limits(context, port.Eval(context), arm.peak, peak)

    def _hands(self, context: Context, memory: Array) -> tuple[Array, Array]:
        first, second = self._arms
        # Both arms have their first readings together.
        if not first.loop.has_reading(memory[first.place]):
            for arm in self._arms:
                arm.loop.pass_through(memory[arm.place], arm.state.Eval(context))
            self._hold_motions(memory)
        return memory[first.motion], memory[second.motion]

    def _check_hands(self, hands: tuple[Array, Array]) -> None:
        """They come from readings that have been checked."""

    def _calc_torque(self, k: int, context: Context, output: BasicVector) -> None:
        found: Found = self._found.Eval(context)
        arm, reference = self._arms[k], found.motions[HANDS.start + k]
        memory, wrench = found.memory[arm.place], found.hand_wrenches[k]
        arm.loop.write_torque(context, memory, reference, wrench, output.get_mutable_value())

    def _measured_motion(self, k: int, context: Context) -> Array:
        return self._hands(context, self._remembered(context))[k]
