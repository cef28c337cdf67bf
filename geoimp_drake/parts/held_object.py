"""The object's part of tight cooperation: from hands and wrenches to the hands' references."""

import numpy as np

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import SignalError
from geoimp_drake.laws.compositions.object_control import (
    COMPLIANT,
    HANDS,
    MEASURED_MUTUAL,
    MUTUAL,
    OBJECT,
    object_control,
)
from geoimp_drake.laws.cooperation.half_rotation import check_half_defined
from geoimp_drake.laws.cooperation.held_object import held_object_motion
from geoimp_drake.laws.cooperation.object_slack import object_slack
from geoimp_drake.laws.frame_motion import (
    FRAME_MOTION_SIZE,
    FRAME_STATE_SIZE,
    POSE_SIZE,
    QUATERNION,
)
from geoimp_drake.parts.found_object import (
    FoundObject,
    write_pose,
    written_motion,
    written_wrench,
)
from geoimp_drake.parts.grasp import GraspPose
from geoimp_drake.parts.grasp_watch import GraspWatch
from geoimp_drake.parts.hold_back import NO_SLACK
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.impedance_energy import ImpedanceEnergy
from geoimp_drake.parts.law_signals import ArmSignals, WatchSignals
from geoimp_drake.parts.object_load import LoadArguments
from geoimp_drake.parts.part import Memory, Now, Output, held, nested
from geoimp_drake.parts.reference_hold import Hold
from geoimp_drake.parts.signals import AT_REST, check_frame_motion, check_wrench, is_set
from geoimp_drake.parts.within import Within
from geoimp_drake.typing import Array

__all__ = ["HeldObject"]

_NO_WRENCH = np.zeros(6)

_Slacks = tuple[Array, Array]
_NO_SLACKS: _Slacks = NO_SLACK, NO_SLACK


class HeldObject:
    """Evaluates the laws of six connected blocks, those of the first four in one compiled call.

        CooperativeKinematics ─▶ ImpedanceIntegrator ─▶ CooperativeReferenceGenerator
                              ─▶ InternalImpedance   ─▶               │
                                         GraspMonitor ─▶ ReferenceHold ◀┘

    The laws are the blocks' own (laws/compositions/object_control.py). A sample of the wrenches
    takes a second call, and the hold after an opened grasp is not compiled. This class is a piece
    of `TwoArms`, whose outputs come from the `FoundObject`.

    The continuous state is that of C, then that of the mutual pose of the references. Both start
    with a simulator's first step, at rest on the measured motions; so does the mutual pose of the
    grasp, unless it is prescribed.

    Args:
        impedance: of the object.
        internal: the impedance between the hands; None for a constant mutual pose.
        grasp: the mutual pose of the grasp.
        load: of the object.
        watch: over the grasps, and what the hands do when one opens; None for neither.

    Attributes:
        last_motion: place in the memory of C's motion when the last step began.
    """

    def __init__(
        self,
        impedance: Impedance,
        internal: Impedance | None,
        grasp: GraspPose,
        load: LoadArguments,
        watch: tuple[GraspWatch, Hold] | None,
    ):
        self._impedance, self._internal, self._grasp = impedance, internal, grasp
        self._watch, self._load = watch, load
        self._law = object_control(impedance.rotation.law)
        self._object_motion = compiled(held_object_motion)
        # Without an internal impedance its gains are not used.
        gains = (impedance if internal is None else internal).gains(None)
        self._constants = internal is not None, *gains, *load.arguments
        self._at_rest = np.zeros(FRAME_MOTION_SIZE)
        self.inputs = {"desired_motion": FRAME_MOTION_SIZE, "stiffness_scale": 2}
        self.state = Memory(compliant=np.zeros(FRAME_STATE_SIZE), mutual=np.zeros(FRAME_STATE_SIZE))
        nothing = Memory()
        self.memory = Memory(
            grasp=grasp.memory,
            impedance=impedance.memory,
            internal=nothing if internal is None else internal.memory,
            # The motions of both hands' references when the last step began.
            reference_1=AT_REST,
            reference_2=AT_REST,
            watch=nothing if watch is None else watch[0].memory,
            hold=nothing if watch is None else watch[1].memory,
        )
        self._slack_law = compiled(object_slack)
        self.last_motion = nested(self.memory.impedance, impedance.memory.last)
        if watch is not None:
            self._opened = nested(self.memory.watch, watch[0].memory.opened)

    def outputs(self, place: slice) -> list[Output]:
        """Returns the outputs.

        Args:
            place: of this part's memory in that of the whole.
        """
        found = ("found",)
        signals = *found, *self.inputs
        outputs = [
            Output("compliant_motion", FRAME_MOTION_SIZE, written_motion(COMPLIANT), found),
            Output("displacement", 6, self._write_displacement, signals),
            Output("energy", len(ImpedanceEnergy.get_fields()), self._write_energy, signals),
            Output("object_motion", FRAME_MOTION_SIZE, written_motion(OBJECT), found),
            Output("object_wrench", 6, written_wrench(0), found),
            Output("internal_wrench", 6, written_wrench(1), found),
            Output("mutual_motion", FRAME_MOTION_SIZE, written_motion(MEASURED_MUTUAL), found),
            Output("mutual_reference", FRAME_MOTION_SIZE, write_pose, found),
            *(
                Output(f"reference_motion_{k + 1}", FRAME_MOTION_SIZE, written_motion(row), found)
                for k, row in enumerate(range(HANDS.start, HANDS.stop))
            ),
        ]
        if self._watch is not None:
            opened, resting = nested(place, self._opened), nested(place, self.memory.hold)
            outputs += [held("opened", opened), self._watch[1].release_of(resting, opened)]
        return outputs

    def new_found(self, arms: dict[int, ArmSignals] | None = None) -> FoundObject:
        """Returns the arrays that the law writes to.

        Args:
            arms: by an arm's number, the signals of its laws, for a part that has arms.
        """
        gains = self._impedance.changing_gains.configured
        return FoundObject(self._law, gains, self._constants, arms or {})

    def find(
        self,
        now: Now,
        memory: Array,
        hands: tuple[Array, Array],
        wrenches: tuple[Array, Array],
        found: FoundObject,
    ) -> None:
        """Evaluates the law.

        Args:
            now: the inputs and the state.
            memory: of this part.
            hands: measured motions (19) of both.
            wrenches: of both (6).
            found: where to write.

        Raises:
            SignalError: an input is NaN or infinite, a quaternion is not unit, or C has diverged.
            OutOfDomainError: the hands have turned by more than 355° against each other, or D and C
                beyond ϑ_M of the orientation family.
            SingularityError: the attitude leaves the domain of the orientation family.
        """
        desired, state = now["desired_motion"], now.state
        found.pose[:] = self._grasp.pose(memory[self.memory.grasp], now, *hands)
        reference = self._at_rest
        if self._load.removes_inertial_load:
            reference = memory[self.last_motion]
        found.take(hands, wrenches, desired, state, reference, self._impedance.gains(now))
        if self._impedance.has_domain:
            C = (
                state[self.state.compliant]
                if is_set(state)
                else self._object_start(now, hands, found)
            )
            self._impedance.check(now, desired, _NO_WRENCH, C)
        if not found.law():
            self._check(now, hands, wrenches, found)
        state[:] = found.state  # a loop's own, with unit quaternions from here on
        if self._watch is not None and self._watch[1].is_held(memory[self.memory.hold]):
            self._rest(self._watch[1], memory, now.time, found.motions[HANDS])

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Starts C, mutual pose and grasp, or keeps their normalized quaternions."""
        self.keep(memory, state, now, _NO_SLACKS)

    def slacks(self, now: Now, first: Array, hands: _Slacks) -> _Slacks:
        """Returns the accelerations of C and of the mutual pose that both arms leave undone (6).

        Args:
            now: has the results.
            first: measured motion of the first hand (19).
            hands: accelerations that the limits leave undone of both hands, in W (6).
        """
        if hands[0] is NO_SLACK and hands[1] is NO_SLACK:
            return _NO_SLACKS
        slacks = np.zeros((2, 6))
        self._slack_law(first[QUATERNION], now.found.motions[:2], *hands, slacks)
        return slacks[0], slacks[1]

    def keep(self, memory: Array, state: Array, now: Now, slacks: _Slacks) -> None:
        """Does what `begin` does, and keeps what holds back C and the mutual pose.

        Args:
            memory: of this part, updated.
            state: of this part, updated.
            now: the inputs.
            slacks: of C and of the mutual pose, see `slacks` (6).
        """
        found: FoundObject = now.found
        C, hands = found.motions[COMPLIANT], found.motions[HANDS]
        state[:] = found.state
        place = memory[self.memory.impedance]
        self._impedance.keep(place, state[self.state.compliant], now, C, slacks[0])
        if self._internal is not None:
            grasp = np.concatenate((found.pose, np.zeros(FRAME_MOTION_SIZE - POSE_SIZE)))
            within = Within(now, {}, {"desired_motion": grasp}, label=", mutual pose")
            place, mutual = memory[self.memory.internal], found.motions[MUTUAL]
            self._internal.keep(place, state[self.state.mutual], within, mutual, slacks[1])
        memory[self.memory.grasp] = found.pose
        memory[self.memory.reference_1], memory[self.memory.reference_2] = hands

    def hold_back(self, memory: Array, rates: Array) -> None:
        """Adds to the derivatives of C's state and of the mutual pose what holds them back.

        Args:
            memory: of this part.
            rates: (26,).
        """
        self._impedance.hold_back(memory[self.memory.impedance], rates[self.state.compliant])
        if self._internal is not None:
            self._internal.hold_back(memory[self.memory.internal], rates[self.state.mutual])

    def sample(
        self, memory: Array, now: Now, wrenches: tuple[Array, Array], signals: WatchSignals | None
    ) -> None:
        """Takes a sample of both hands' wrenches for the watch over the grasps, in `signals`."""
        if self._watch is None or signals is None:
            return
        watch, hold = self._watch
        # A hold follows one sample after its cause, as behind a port.
        opened, place = memory[self._opened], memory[self.memory.hold]
        if hold.is_due(place, opened):
            first, second = now.found.motions[HANDS]
            given = {"opened": opened, "reference_motion_1": first, "reference_motion_2": second}
            hold.sample(place, Within(now, {}, given))
        watch.take(memory[self.memory.watch], *wrenches, now, signals)

    def new_workspace(self) -> WatchSignals | None:
        """Returns where a sample is taken, if there is a watch."""
        return None if self._watch is None else self._watch[0].new_workspace()

    def _rest(self, hold: Hold, memory: Array, time: float, references: Array) -> None:
        """Writes the hands' motions after the hold in place of their references (2, 19)."""
        opened = memory[self._opened]
        for k, reference in enumerate(references, 1):
            reference[:] = hold.motion(k, memory[self.memory.hold], time, opened)

    def _object_start(self, now: Now, hands: tuple[Array, Array], found: FoundObject) -> Array:
        """Returns the object's pose and velocity as measured (13): C starts at that pose."""
        for k in (1, 2):
            check_frame_motion(hands[k - 1], now.port(f"measured_motion_{k}"))
        self._object_motion(*hands, found.pose[QUATERNION], found.motions[:2])
        check_half_defined(found.motions[MEASURED_MUTUAL])
        return found.motions[OBJECT, :FRAME_STATE_SIZE]

    def _check(
        self,
        now: Now,
        hands: tuple[Array, Array],
        wrenches: tuple[Array, Array],
        found: FoundObject,
    ) -> None:
        """Raises the error of the signal that the law cannot use, with the port's name."""
        self._object_start(now, hands, found)
        for k in (1, 2):
            check_wrench(wrenches[k - 1], now.port(f"wrench_{k}"))
        C, mutual = found.state[self.state.compliant], found.state[self.state.mutual]
        # The mutual pose comes first: a grasp that cannot be held also makes the object diverge.
        if self._internal is not None:
            within = Within(now, {}, {}, label=", mutual pose")
            self._internal.check(within, AT_REST, found.wrenches[2], mutual)
        self._impedance.check(now, now["desired_motion"], found.wrenches[0], C)
        if self._internal is not None and is_set(mutual):
            check_half_defined(mutual)
        raise SignalError(f"{now.system}: the references of the hands are not finite.")

    def _write_displacement(self, now: Now, value: Array) -> None:
        C = now.found.motions[COMPLIANT]
        value[:] = self._impedance.displacement(now["desired_motion"], C)

    def _write_energy(self, now: Now, value: Array) -> None:
        found = now.found
        value[:] = self._impedance.energy(now, found.motions[COMPLIANT], found.wrenches[0])
