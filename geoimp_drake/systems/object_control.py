"""The object's part of tight cooperation as one system: its blocks, sooner."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import (
    Context,
    ContinuousState,
    DiscreteValues,
    State,
    ValueProducer,
)

from geoimp_drake.compiled import compiled
from geoimp_drake.errors import SignalError
from geoimp_drake.laws.half_rotation import check_half_defined
from geoimp_drake.laws.object_control import (
    COMPLIANT,
    HANDS,
    MEASURED_MUTUAL,
    MUTUAL,
    OBJECT,
    object_control,
)
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.cooperative_kinematics import CooperativeKinematics
from geoimp_drake.systems.cooperative_reference_generator import (
    CooperativeReferenceGenerator,
    measured_mutual_pose,
)
from geoimp_drake.systems.declaring import declare_cache, declare_output, tickets_of
from geoimp_drake.systems.frame_motion import (
    FRAME_MOTION_SIZE,
    FRAME_STATE_SIZE,
    POSE_SIZE,
    check_frame_motion,
    check_signal,
    frame_motion_vector,
    is_set,
)
from geoimp_drake.systems.grasp_monitor import NOTHING_OPENED, TIMES_AT_START, GraspMonitor
from geoimp_drake.systems.impedance_integrator import ImpedanceEnergy, ImpedanceIntegrator
from geoimp_drake.systems.internal_impedance import InternalImpedance
from geoimp_drake.systems.reference_hold import (
    NOTHING_HELD,
    ReferenceHold,
    is_held,
    is_hold_due,
)
from geoimp_drake.typing import Array

__all__ = ["ObjectControl"]

_NO_WRENCH = np.zeros(6)


# In one group of the state: ¹Q_21 and ᵒΔp_21 of the grasp, zeros for none yet; what is held; and
# the motion of C when the last step began, to which a sensor's reading belongs.
_POSE, _HELD = slice(0, POSE_SIZE), slice(POSE_SIZE, POSE_SIZE + len(NOTHING_HELD))
_LAST = slice(_HELD.stop, _HELD.stop + FRAME_MOTION_SIZE)


@dataclass(slots=True)
class _Found:
    """What one evaluation of the law gives."""

    motions: Array = field(default_factory=lambda: np.zeros((6, 19)))  # laws/object_control.py
    wrenches: Array = field(default_factory=lambda: np.empty((3, 6)))
    rates: Array = field(default_factory=lambda: np.empty(2 * FRAME_STATE_SIZE))  # of the state
    is_grasped: bool = False  # whether the state has the grasp's mutual pose already


class ObjectControl(Block):
    """Finds the references of two hands that make their object compliant: six blocks as one.

    It does what these do, connected with each other, with the same laws and the same numbers, in
    one compiled call for a state (laws/object_control.py), and one for a sample of the wrenches:

        CooperativeKinematics ─▶ ImpedanceIntegrator ─▶ CooperativeReferenceGenerator
                              ─▶ InternalImpedance   ─▶               │
                                         GraspMonitor ─▶ ReferenceHold ◀┘

    The continuous state is that of C, then that of the mutual pose of the references. Both start
    with a simulator's first step, at rest on the measured motions; so does the mutual pose of the
    grasp, unless it is prescribed.

    Args:
        kinematics: the block whose load and gravity it takes over.
        impedance: the block whose gains it takes over; its orientation family is the quaternion.
        references: the block whose prescribed pose it takes over.
        internal: the block whose gains it takes over; None for a constant mutual pose.
        watch: the blocks whose monitoring and hold it takes over; None for neither.
        removes_inertial_load: of the object; else its weight alone.

    Raises:
        SignalError: an input is NaN or infinite, a quaternion is not unit, or C has diverged.
        OutOfDomainError: the hands have turned by more than 355° against each other.

    Ports:
        input desired_motion: of D, the object's, in W (19)
        input stiffness_scale: factors of K_p and K_o, one each if not connected (2)
        input wrench_1: h = [μ; f] by the first hand on its environment, about Eo, in W (6)
        input wrench_2: the same by the second (6)
        input measured_motion_1: of the first hand in W (19)
        input measured_motion_2: of the second (19)
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

        Without `watch` there are no ports `opened` and `release`.
    """

    def __init__(
        self,
        kinematics: CooperativeKinematics,
        impedance: ImpedanceIntegrator,
        references: CooperativeReferenceGenerator,
        internal: InternalImpedance | None,
        watch: tuple[GraspMonitor, ReferenceHold] | None = None,
        *,
        removes_inertial_load: bool,
    ):
        super().__init__()
        self._hold = None if watch is None else watch[1]
        self._impedance, self._internal = impedance, internal
        self._prescribed = references.prescribed
        self._removes_inertial_load = removes_inertial_load
        self._law: Callable[..., bool] = compiled(object_control)
        self._load = kinematics.load_arguments
        # Without one its gains are not used.
        second = impedance if internal is None else internal
        self._internal_gains = internal is not None, *second.gains("internal")
        self._at_rest = np.zeros(FRAME_MOTION_SIZE)
        self._declare_inputs()
        self._declare_state()
        if watch is not None:
            self._declare_watch(*watch)
        self._declare_outputs()

    def _declare_inputs(self) -> None:
        motion = frame_motion_vector()
        self._desired = self.DeclareVectorInputPort("desired_motion", motion)
        self._scale = self.DeclareVectorInputPort("stiffness_scale", 2)
        self._wrenches = [self.DeclareVectorInputPort(f"wrench_{k}", 6) for k in (1, 2)]
        self._hands = [self.DeclareVectorInputPort(f"measured_motion_{k}", motion) for k in (1, 2)]

    def _declare_state(self) -> None:
        # As declared it is zero, quaternions included: nothing has started.
        self.DeclareContinuousState(2 * FRAME_STATE_SIZE)
        self._grasp = self.declare_state(np.zeros(_LAST.stop))
        self._last_references = [self.declare_state(frame_motion_vector()) for _ in range(2)]
        self.DeclareInitializationUnrestrictedUpdateEvent(self._stop)
        self.DeclareInitializationPublishEvent(self._check)
        self.DeclarePerStepUnrestrictedUpdateEvent(self._start_or_normalize)

    def _declare_watch(self, monitor: GraspMonitor, hold: ReferenceHold) -> None:
        self._times = self.declare_state(TIMES_AT_START)
        self._opened = self.declare_state(NOTHING_OPENED)
        # Without offset, so that its instants are those of the plant's steps to the last bit.
        self.DeclarePeriodicDiscreteUpdateEvent(
            monitor.period, 0.0, partial(self._watch_grasps, monitor, hold)
        )

    def _declare_outputs(self) -> None:
        inputs = tickets_of(self, self._desired, self._scale)
        hands = tickets_of(self, *self._hands)
        grasp = hands | {self.ticket_of_state(self._grasp)}
        law = inputs | grasp | tickets_of(self, *self._wrenches)
        law |= {self.xc_ticket()}
        if self._hold is not None:
            law |= {self.time_ticket(), self.ticket_of_state(self._opened)}
        # They change when the scale does, not with every step.
        self._gains = declare_cache(self, "gains", self._calc_gains, tickets_of(self, self._scale))
        self._found = self.DeclareCacheEntry(
            "object", ValueProducer(lambda: AbstractValue.Make(_Found()), self._calc_found), law
        )
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
        for k in range(2):
            self.declare_state_output(f"last_reference_motion_{k + 1}", self._last_references[k])
        if self._hold is not None:
            self.declare_state_output("opened", self._opened)
            release = {self.ticket_of_state(k) for k in (self._grasp, self._opened)}
            release |= {self.time_ticket()}
            declare_output(self, "release", 2, partial(self._release, self._hold), release)

    def _stop(self, context: Context, state: State) -> None:
        """Forgets C and the grasp. They start with the first step, after the joints' readings."""
        state.get_mutable_continuous_state().SetFromVector(np.zeros(2 * FRAME_STATE_SIZE))
        start = [
            (self._grasp, np.zeros(_LAST.stop)),
            *((last, frame_motion_vector().value()) for last in self._last_references),
        ]
        if self._hold is not None:
            start += [(self._times, TIMES_AT_START), (self._opened, NOTHING_OPENED)]
        for group, value in start:
            state.get_mutable_discrete_state(group).SetFromVector(value)

    def _check(self, context: Context) -> None:
        """Evaluates the law, so that initialization already refuses what it cannot use."""
        self._found.Eval(context)

    def _start_or_normalize(self, context: Context, state: State) -> None:
        # The law's quaternions are normalized. This comes with the plant's step, whose torques have
        # evaluated the law already.
        found = self._found.Eval(context)
        x = found.motions[COMPLIANT : MUTUAL + 1, :FRAME_STATE_SIZE].ravel()
        state.get_mutable_continuous_state().SetFromVector(x)
        discrete = state.get_mutable_discrete_state()
        for last, reference in zip(self._last_references, found.motions[HANDS], strict=True):
            discrete.set_value(last, reference)
        grasp = discrete.get_mutable_value(self._grasp)
        grasp[_LAST] = found.motions[COMPLIANT]
        if not found.is_grasped:
            grasp[_POSE] = self._initial_pose(self._measured(context))

    def _watch_grasps(
        self, monitor: GraspMonitor, hold: ReferenceHold, context: Context, state: DiscreteValues
    ) -> None:
        # Drake hands over a copy of the context's state.
        times, opened = state.get_mutable_value(self._times), state.get_mutable_value(self._opened)
        # A hold follows one sample after what it is for, as behind a port.
        if opened[0] or opened[1]:
            held = state.get_mutable_value(self._grasp)[_HELD]
            if is_hold_due(held, opened):
                references = list(self._motions(context)[HANDS])
                hold.take(self.get_name(), references, context.get_time(), held)
        h_1, h_2 = (port.Eval(context) for port in self._wrenches)
        monitor.watch(self.get_name(), context, h_1, h_2, times, opened)

    def _mutual_pose(self, context: Context) -> Array:
        """Returns ¹Q_21 and ᵒΔp_21 (7) of the grasp."""
        pose: Array = context.get_discrete_state(self._grasp).value()[_POSE]
        return pose if is_set(pose) else self._initial_pose(self._measured(context))

    def _initial_pose(self, hands: list[Array]) -> Array:
        if self._prescribed is not None:
            return self._prescribed
        return measured_mutual_pose(self.get_name(), *hands)

    def _measured(self, context: Context) -> list[Array]:
        return [port.Eval(context) for port in self._hands]

    def _calc_gains(self, context: Context, value: AbstractValue) -> None:
        value.set_value(self._impedance.gains(self.get_name(), self._factors(context)))

    def _factors(self, context: Context) -> Array | None:
        return self._scale.Eval(context) if self._scale.HasValue(context) else None

    def _calc_found(self, context: Context, value: AbstractValue) -> None:
        first, second = self._hands
        wrench_1, wrench_2 = self._wrenches
        hands = [first.Eval(context), second.Eval(context)]
        wrenches = [wrench_1.Eval(context), wrench_2.Eval(context)]
        desired = self._desired.Eval(context)
        # A copy: the law is compiled once more for an array that cannot be written to.
        grasp = context.get_discrete_state(self._grasp).CopyToVector()
        found = value.get_mutable_value()
        found.is_grasped = is_set(grasp)
        pose = grasp[_POSE] if found.is_grasped else self._initial_pose(hands)
        state = context.get_continuous_state_vector().CopyToVector()
        reference = grasp[_LAST] if self._removes_inertial_load else self._at_rest
        if not self._law(
            *hands,
            *wrenches,
            desired,
            state,
            pose,
            reference,
            found.motions,
            found.wrenches,
            found.rates,
            *self._gains.Eval(context),
            *self._internal_gains,
            *self._load,
        ):
            self._check_signals(hands, wrenches, desired, state, found.motions)
        held = grasp[_HELD]
        if self._hold is not None and is_held(held):
            self._rest(self._hold, context, held, found.motions[HANDS])

    def _rest(self, hold: ReferenceHold, context: Context, held: Array, references: Array) -> None:
        """Writes how the hands move since they are held."""
        opened = context.get_discrete_state(self._opened).value()
        for k, reference in enumerate(references):
            reference[:] = hold.motion(k, held, context.get_time(), opened)

    def _check_signals(
        self,
        hands: list[Array],
        wrenches: list[Array],
        desired: Array,
        state: Array,
        motions: Array,
    ) -> None:
        """Raises, by name, for what the law cannot use."""
        name = self.get_name()
        for k in range(2):
            check_frame_motion(hands[k], f"{name}:measured_motion_{k + 1}")
            check_signal(wrenches[k], f"{name}:wrench_{k + 1}")
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
        derivatives.SetFromVector(self._found.Eval(context).rates)

    def _motions(self, context: Context) -> Array:
        motions: Array = self._found.Eval(context).motions
        return motions

    def _reference(self, k: int, context: Context) -> Array:
        reference: Array = self._found.Eval(context).motions[HANDS.start + k]
        return reference

    def _mutual_reference(self, context: Context) -> Array:
        motion = np.zeros(FRAME_MOTION_SIZE)
        motion[:POSE_SIZE] = self._mutual_pose(context)
        return motion

    def _release(self, hold: ReferenceHold, context: Context) -> Array:
        held = context.get_discrete_state(self._grasp).value()[_HELD]
        opened = context.get_discrete_state(self._opened).value()
        return hold.release(held, context.get_time(), opened)

    def _displacement(self, context: Context) -> Array:
        return self._impedance.displacement(
            self._desired.Eval(context), self._motions(context)[COMPLIANT]
        )

    def _energy(self, context: Context) -> Array:
        found = self._found.Eval(context)
        D, C = self._desired.Eval(context), found.motions[COMPLIANT]
        return self._impedance.energy(D, C, found.wrenches[0], self._factors(context))
