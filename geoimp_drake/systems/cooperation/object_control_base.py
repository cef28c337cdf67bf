"""The object's part of tight cooperation, for the systems that contain it."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import (
    Context,
    ContinuousState,
    DependencyTicket,
    DiscreteValues,
    State,
    ValueProducer,
)

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import SignalError
from geoimp_drake.laws.compositions.object_control import (
    COMPLIANT,
    HANDS,
    MEASURED_MUTUAL,
    OBJECT,
    object_control,
)
from geoimp_drake.laws.cooperation.half_rotation import check_half_defined
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.cooperation.cooperative_kinematics import CooperativeKinematics
from geoimp_drake.systems.cooperation.cooperative_reference_generator import (
    CooperativeReferenceGenerator,
    measured_mutual_pose,
)
from geoimp_drake.systems.cooperation.grasp_monitor import (
    NOTHING_OPENED,
    TIMES_AT_START,
    GraspMonitor,
)
from geoimp_drake.systems.cooperation.internal_impedance import InternalImpedance
from geoimp_drake.systems.cooperation.reference_hold import (
    NOTHING_HELD,
    ReferenceHold,
    is_held,
    is_hold_due,
)
from geoimp_drake.systems.declaring import declare_output, tickets_of
from geoimp_drake.systems.frame_motion import (
    FRAME_MOTION_SIZE,
    FRAME_STATE_SIZE,
    POSE_SIZE,
    check_signal,
    frame_motion_vector,
    is_set,
)
from geoimp_drake.systems.impedance_integrator import ImpedanceEnergy, ImpedanceIntegrator
from geoimp_drake.systems.stiffness_scale import StiffnessScale
from geoimp_drake.typing import Array

__all__ = ["MEMORY_SIZE", "Found", "ObjectBlocks", "ObjectControlBase"]

_NO_WRENCH, _NOTHING = np.zeros(6), np.empty(0)


# What is remembered in one group of the state: ¹Q_21 and ᵒΔp_21 of the grasp, zeros for none yet;
# what is held; and the motion of C when the last step began, to which a sensor's reading belongs.
# What a subclass remembers follows.
_POSE, _HELD = slice(0, POSE_SIZE), slice(POSE_SIZE, POSE_SIZE + len(NOTHING_HELD))
_LAST = slice(_HELD.stop, _HELD.stop + FRAME_MOTION_SIZE)
MEMORY_SIZE = _LAST.stop


@dataclass(frozen=True)
class ObjectBlocks:
    """The blocks between hands and their references, whose work one system takes over."""

    kinematics: CooperativeKinematics  # its load and gravity
    impedance: ImpedanceIntegrator  # its gains; the orientation family is the quaternion
    references: CooperativeReferenceGenerator  # its prescribed pose
    internal: InternalImpedance | None  # its gains; None for a constant mutual pose
    watch: tuple[GraspMonitor, ReferenceHold] | None  # both as they are; None for neither
    removes_inertial_load: bool  # of the object; else its weight alone


@dataclass(slots=True)
class Found:
    """What one evaluation of the law gives, and what of the state and inputs it took."""

    motions: Array = field(default_factory=lambda: np.zeros((6, 19)))  # laws/object_control.py
    wrenches: Array = field(default_factory=lambda: np.empty((3, 6)))
    state: Array = field(default_factory=lambda: _NOTHING)  # that of the motions
    rates: Array = field(default_factory=lambda: np.empty(2 * FRAME_STATE_SIZE))  # of the state
    memory: Array = field(default_factory=lambda: _NOTHING)
    pose: Array = field(default_factory=lambda: _NOTHING)  # of the grasp
    hand_wrenches: tuple[Array, Array] = (_NO_WRENCH, _NO_WRENCH)


class ObjectControlBase(Block):
    """What `ObjectControl` and `CooperativeControl` have in common: all but where the hands are.

    A subclass declares its inputs, then state and outputs by `_declare_state`, `_declare_outputs`.

    Args:
        blocks: whose work it does.
    """

    def __init__(self, blocks: ObjectBlocks):
        super().__init__()
        self._watch = blocks.watch
        self._impedance, self._internal = blocks.impedance, blocks.internal
        self._prescribed = blocks.references.prescribed
        self._removes_inertial_load = blocks.removes_inertial_load
        self._law: Callable[..., bool] = compiled(object_control)
        self._load = blocks.kinematics.load_arguments
        # Without one its gains are not used.
        second = blocks.impedance if blocks.internal is None else blocks.internal
        self._internal_gains = blocks.internal is not None, *second.gains("internal")
        self._at_rest = np.zeros(FRAME_MOTION_SIZE)

    def _hands(self, context: Context, memory: Array) -> tuple[Array, Array]:
        """Returns the measured motions (19) of both hands.

        Args:
            context: of this system.
            memory: a copy of it; what passes through before initialization may be written there.
        """
        raise NotImplementedError

    def _check_hands(self, hands: tuple[Array, Array]) -> None:
        """Raises SignalError, by name, for a motion that cannot be used."""
        raise NotImplementedError

    def _declare_object_inputs(self, *, wrenches: bool = True) -> None:
        """Declares the inputs; `wrenches` is off if a subclass knows those of the hands."""
        self._desired = self.DeclareVectorInputPort("desired_motion", frame_motion_vector())
        self._scale = StiffnessScale(self, self._impedance.gains)
        names = ("wrench_1", "wrench_2") if wrenches else ()
        self._wrenches = [self.DeclareVectorInputPort(name, 6) for name in names]

    def _hand_wrenches(self, context: Context, memory: Array) -> tuple[Array, Array]:
        """Returns the wrenches (6) of both hands.

        Args:
            context: of this system.
            memory: of it.
        """
        first, second = self._wrenches
        return first.Eval(context), second.Eval(context)

    def _declare_state(self, *further: Array, last_references: bool = True) -> None:
        """Declares state and its events but for the samples.

        Args:
            further: memory of a subclass.
            last_references: off if a subclass keeps them there.
        """
        # As declared it is zero, quaternions included: nothing has started.
        self.DeclareContinuousState(2 * FRAME_STATE_SIZE)
        self._memory_at_start = np.concatenate((np.zeros(MEMORY_SIZE), *further))
        self._memory = self.declare_state(self._memory_at_start)
        hands = range(2 if last_references else 0)
        self._last_references = [self.declare_state(frame_motion_vector()) for _ in hands]
        if self._watch is not None:
            self._times = self.declare_state(TIMES_AT_START)
            self._opened = self.declare_state(NOTHING_OPENED)
        self.DeclareInitializationUnrestrictedUpdateEvent(self._stop)
        self.DeclareInitializationPublishEvent(self._check)
        self.DeclarePerStepUnrestrictedUpdateEvent(self._start_or_normalize)

    def _keep_references(self, references: Array, memory: Array, discrete: DiscreteValues) -> None:
        """Keeps what the hands follow as a step begins; `memory` is the one in that state."""
        for last, reference in zip(self._last_references, references, strict=True):
            discrete.set_value(last, reference)

    def _declare_outputs(self, hands: set[DependencyTicket]) -> None:
        """Declares the outputs; `hands` are the tickets of the inputs that tell their motions."""
        inputs = tickets_of(self, self._desired, self._scale.port)
        grasp = hands | {self.ticket_of_state(self._memory)}
        law = inputs | grasp | tickets_of(self, *self._wrenches)
        law |= {self.xc_ticket()}
        if self._watch is not None:
            law |= {self.time_ticket(), self.ticket_of_state(self._opened)}
        self._found = self.DeclareCacheEntry(
            "object", ValueProducer(lambda: AbstractValue.Make(Found()), self._calc_found), law
        )
        # What is found depends on all of it, the outputs on what is found: Drake follows each of
        # these connections in every step.
        self._law_tickets = law = {self._found.ticket()}
        declare_output(self, "compliant_motion", 19, lambda c: self._motions(c)[COMPLIANT], law)
        declare_output(self, "displacement", 6, self._displacement, law)
        declare_output(self, "energy", len(ImpedanceEnergy.get_fields()), self._energy, law)
        declare_output(self, "object_motion", 19, lambda c: self._motions(c)[OBJECT], law)
        declare_output(self, "object_wrench", 6, lambda c: self._found.Eval(c).wrenches[0], law)
        declare_output(self, "internal_wrench", 6, lambda c: self._found.Eval(c).wrenches[1], law)
        declare_output(self, "mutual_motion", 19, lambda c: self._motions(c)[MEASURED_MUTUAL], law)
        declare_output(self, "mutual_reference", 19, self._mutual_reference, grasp)
        for k in range(2):
            declare_output(self, f"reference_motion_{k + 1}", 19, partial(self._reference, k), law)
        for k, last in enumerate(self._last_references, 1):
            self.declare_state_output(f"last_reference_motion_{k}", last)
        if self._watch is not None:
            self.declare_state_output("opened", self._opened)
            release = {self.ticket_of_state(k) for k in (self._memory, self._opened)}
            release |= {self.time_ticket()}
            declare_output(self, "release", 2, partial(self._release, self._watch[1]), release)

    def _stop(self, context: Context, state: State) -> None:
        """Forgets C and the grasp. They start with the first step, after the joints' readings."""
        state.get_mutable_continuous_state().SetFromVector(np.zeros(2 * FRAME_STATE_SIZE))
        start = [
            (self._memory, self._memory_to_start_with(context)),
            *((last, frame_motion_vector().value()) for last in self._last_references),
        ]
        if self._watch is not None:
            start += [(self._times, TIMES_AT_START), (self._opened, NOTHING_OPENED)]
        for group, value in start:
            state.get_mutable_discrete_state(group).SetFromVector(value)

    def _memory_to_start_with(self, context: Context) -> Array:
        return self._memory_at_start

    def _check(self, context: Context) -> None:
        """Evaluates the law, so that initialization already refuses what it cannot use."""
        self._found.Eval(context)

    def _start_or_normalize(self, context: Context, state: State) -> None:
        # The law's quaternions are normalized. This comes with the plant's step, whose torques have
        # evaluated the law already.
        found = self._found.Eval(context)
        state.get_mutable_continuous_state().SetFromVector(found.state)
        discrete = state.get_mutable_discrete_state()
        memory = discrete.get_mutable_value(self._memory)
        memory[_LAST], memory[_POSE] = found.motions[COMPLIANT], found.pose
        self._keep_references(found.motions[HANDS], memory, discrete)

    def _watch_grasps(
        self,
        watch: tuple[GraspMonitor, ReferenceHold],
        context: Context,
        state: DiscreteValues,
        memory: Array,
    ) -> None:
        """Takes a sample of the wrenches for the watch; `memory` is the one in that state."""
        monitor, hold = watch
        # Drake hands over a copy of the context's state.
        times, opened = state.get_mutable_value(self._times), state.get_mutable_value(self._opened)
        # A hold follows one sample after what it is for, as behind a port.
        if opened[0] or opened[1]:
            held = memory[_HELD]
            if is_hold_due(held, opened):
                references = list(self._motions(context)[HANDS])
                hold.take(self.get_name(), references, context.get_time(), held)
        monitor.watch(self, context, *self._hand_wrenches(context, memory), times, opened)

    def _pose(self, memory: Array, hands: tuple[Array, Array]) -> Array:
        """Returns ¹Q_21 and ᵒΔp_21 (7) of the grasp."""
        if is_set(memory):
            return memory[_POSE]
        if self._prescribed is not None:
            return self._prescribed
        return measured_mutual_pose(self.get_name(), *hands)

    def _remembered(self, context: Context) -> Array:
        # A copy: a law is compiled once more for an array that cannot be written to.
        memory: Array = context.get_discrete_state(self._memory).CopyToVector()
        return memory

    def _calc_found(self, context: Context, value: AbstractValue) -> None:
        self._find(context, value.get_mutable_value())

    def _find(self, context: Context, found: Found) -> None:
        """Evaluates the law."""
        memory = self._remembered(context)
        hands = self._hands(context, memory)
        wrenches = self._hand_wrenches(context, memory)
        desired = self._desired.Eval(context)
        found.memory, found.hand_wrenches = memory, wrenches
        found.pose = self._pose(memory, hands)
        found.state = state = context.get_continuous_state_vector().CopyToVector()
        reference = memory[_LAST] if self._removes_inertial_load else self._at_rest
        if not self._law(
            *hands,
            *wrenches,
            desired,
            state,
            found.pose,
            reference,
            found.motions,
            found.wrenches,
            found.rates,
            *self._scale.gains(context),
            *self._internal_gains,
            *self._load,
        ):
            self._check_signals(hands, wrenches, desired, state, found.motions)
        if self._watch is not None and is_held(memory[_HELD]):
            self._rest(self._watch[1], context, memory[_HELD], found.motions[HANDS])

    def _rest(self, hold: ReferenceHold, context: Context, held: Array, references: Array) -> None:
        """Writes how the hands move since they are held."""
        opened = context.get_discrete_state(self._opened).value()
        for k, reference in enumerate(references):
            reference[:] = hold.motion(k, held, context.get_time(), opened)

    def _check_signals(
        self,
        hands: tuple[Array, Array],
        wrenches: tuple[Array, Array],
        desired: Array,
        state: Array,
        motions: Array,
    ) -> None:
        """Raises, by name, for what the law cannot use."""
        name = self.get_name()
        self._check_hands(hands)
        for k, wrench in enumerate(wrenches, 1):
            check_signal(wrench, f"{name}:wrench_{k}")
        C, mutual = state[:FRAME_STATE_SIZE], state[FRAME_STATE_SIZE:]
        self._impedance.check_signals(name, desired, _NO_WRENCH, C)
        check_half_defined(motions[MEASURED_MUTUAL])
        if self._internal is not None:
            at_rest = frame_motion_vector().value()
            self._internal.check_signals(f"{name}, mutual pose", at_rest, _NO_WRENCH, mutual)
            if is_set(mutual):
                check_half_defined(mutual)
        raise SignalError(f"{name}: the references of the hands are not finite.")

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        """Integrates C and the mutual pose; a part without impedance follows D."""
        # As for `ImpedanceIntegrator`: what is in the cache is from before the last sample.
        found = Found()
        self._find(context, found)
        derivatives.SetFromVector(found.rates)

    def _motions(self, context: Context) -> Array:
        motions: Array = self._found.Eval(context).motions
        return motions

    def _reference(self, k: int, context: Context) -> Array:
        reference: Array = self._found.Eval(context).motions[HANDS.start + k]
        return reference

    def _mutual_reference(self, context: Context) -> Array:
        motion, memory = np.zeros(FRAME_MOTION_SIZE), self._remembered(context)
        motion[:POSE_SIZE] = self._pose(memory, self._hands(context, memory))
        return motion

    def _release(self, hold: ReferenceHold, context: Context) -> Array:
        held = context.get_discrete_state(self._memory).value()[_HELD]
        opened = context.get_discrete_state(self._opened).value()
        return hold.release(held, context.get_time(), opened)

    def _displacement(self, context: Context) -> Array:
        return self._impedance.displacement(
            self._desired.Eval(context), self._motions(context)[COMPLIANT]
        )

    def _energy(self, context: Context) -> Array:
        found = self._found.Eval(context)
        D, C = self._desired.Eval(context), found.motions[COMPLIANT]
        return self._impedance.energy(D, C, found.wrenches[0], self._scale.factors(context))
