"""From the compliant motion of an object to the motions of the two hands that hold it."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import (
    Context,
    EventStatus,
    InputPort,
    State,
    ValueProducer,
)

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.cooperation import absolute_pose, mutual_pose
from geoimp_drake.laws.cooperation.half_rotation import check_half_defined
from geoimp_drake.laws.cooperation.hand_references import moving_references, rigid_references
from geoimp_drake.laws.frame_motion import is_frame_motion
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.frame_motion import (
    FRAME_MOTION_SIZE,
    POSE_SIZE,
    POSITION,
    QUATERNION,
    check_frame_motion,
    frame_motion_vector,
)
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, finite_vector, key

__all__ = [
    "CooperativeReferenceGenerator",
    "MutualPose",
    "measured_mutual_pose",
]


@dataclass
class MutualPose:
    """Where the second hand is from the first, as the grasp's geometry and calibration say."""

    quaternion: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))  # ¹Q_21
    position: Array = field(default_factory=lambda: np.array([0.0, 1.0, 0.0]))  # ᵒΔp_21 [m]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError or SignalError if a field cannot be used."""
        finite_vector(self.position, key(name, "position"), 3)
        quaternion.check_unit(
            finite_vector(self.quaternion, key(name, "quaternion"), 4), key(name, "quaternion")
        )

    def pose(self) -> Array:
        """Returns ¹Q_21 and ᵒΔp_21 (7), with the sign of ¹Q_21 that decides where O is."""
        Q = np.asarray(self.quaternion, dtype=float)
        Q_12 = mutual_pose.mutual_orientation_at_start(np.array([1.0, 0.0, 0.0, 0.0]), Q)
        return np.concatenate((quaternion.normalized(Q_12), self.position))


class CooperativeReferenceGenerator(Block):
    """Computes the motions (4.10)-(4.15) of two hands that make their object move as C does.

        (4.10), (4.11)  p_r1 = p_c − ½ Δp_r21,   p_r2 = p_c + ½ Δp_r21
        (4.12), (4.13)  Q_r1 = Q_c * {cos(ϑ_r21/4), −sin(ϑ_r21/4) ¹r_r21},   Q_r2 = Q_r1 * ¹Q_r21
        (4.14), (4.15)  v_r1 = v_c − ½ Δv_r21,   v_r2 = v_c + ½ Δv_r21

    with accelerations that are their derivatives. The mutual pose ¹Q_r21, ᶜΔp_r21 = R_cᵀΔp_r21 is
    constant in C: equal to that of the measured motions with a simulator's first step (and, so that
    the ports can be evaluated without one, before it), or as prescribed. Initialize the simulator
    again to take it anew.

    If `mutual_motion` is connected, it takes the place of the constant mutual pose (see
    `InternalImpedance`); the references' velocities and accelerations are then the derivatives of
    poses with a mutual pose that moves.

    Frames: W world, C compliant (where the object O has to be), 1 and 2 the end effectors.

    Args:
        prescribed: the mutual pose; by default that of the measured motions at the start.

    Raises:
        ConfigurationError: the prescribed pose cannot be used.
        SignalError: an input is NaN or infinite, or a quaternion is not unit.
        OutOfDomainError: the hands' references turn by more than 355° against each other.

    Ports:
        input compliant_motion: of C in W (19)
        input measured_motion_1: of the first hand in W, read until the first step only (19)
        input measured_motion_2: of the second (19)
        input mutual_motion: ¹Q_r21, ᶜΔp_r21 and their derivatives; optional (19)
        output reference_motion_1: of the first hand in W (19)
        output reference_motion_2: of the second (19)
        output mutual_reference: the constant mutual pose ¹Q_21, ᵒΔp_21, at rest (19)
    """

    def __init__(self, prescribed: MutualPose | None = None):
        super().__init__()
        if prescribed is not None:
            check(prescribed, "mutual_pose")
        self._prescribed = None if prescribed is None else prescribed.pose()
        self._compliant, self._first, self._second, self._mutual = (
            self.DeclareVectorInputPort(name, frame_motion_vector())
            for name in (
                "compliant_motion",
                "measured_motion_1",
                "measured_motion_2",
                "mutual_motion",
            )
        )
        self._rigid, self._moving = compiled(rigid_references), compiled(moving_references)
        self._is_motion = compiled(is_frame_motion)
        # As declared it is zero, quaternion included: no mutual pose has been taken yet.
        pose = self.declare_state(POSE_SIZE)
        self.DeclareInitializationUnrestrictedUpdateEvent(self._forget)
        self.DeclarePerStepUnrestrictedUpdateEvent(self._start)
        start = {self.ticket_of_state(pose)} | self._tickets(self._first, self._second)
        law = start | self._tickets(self._compliant, self._mutual)
        self._references = self.DeclareCacheEntry(
            "references",
            ValueProducer(lambda: AbstractValue.Make(object()), self._calc_references),
            law,
        )
        self._declare("reference_motion_1", lambda c: self._references.Eval(c)[0], law)
        self._declare("reference_motion_2", lambda c: self._references.Eval(c)[1], law)
        self._declare("mutual_reference", self._mutual_reference, start)

    def _tickets(self, *ports: InputPort) -> set:
        return {self.input_port_ticket(port.get_index()) for port in ports}

    def _declare(self, name: str, law: Callable[[Context], Array], tickets: set) -> None:
        self.DeclareVectorOutputPort(
            name,
            frame_motion_vector(),
            lambda context, output: output.SetFromVector(law(context)),
            tickets,
        )

    def _forget(self, context: Context, state: State) -> EventStatus:
        """Forgets the grasp. It is taken with the first step: by then the joints have been read."""
        state.get_mutable_discrete_state().set_value(np.zeros(POSE_SIZE))
        return EventStatus.Succeeded()

    def _start(self, context: Context, state: State) -> EventStatus:
        if not context.get_discrete_state_vector().value().any():
            state.get_mutable_discrete_state().set_value(self._mutual_pose(context))
            return EventStatus.Succeeded()
        return EventStatus.DidNothing()

    def _mutual_pose(self, context: Context) -> Array:
        """Returns ¹Q_21 and ᵒΔp_21 (7) of the grasp."""
        held: Array = context.get_discrete_state_vector().value()
        if held.any():
            return held
        return self._measured_pose(context) if self._prescribed is None else self._prescribed

    def _measured_pose(self, context: Context) -> Array:
        hands = self._first.Eval(context), self._second.Eval(context)
        return measured_mutual_pose(self.get_name(), *hands)

    @property
    def prescribed(self) -> Array | None:
        """¹Q_21 and ᵒΔp_21 (7,) of the grasp, None if they are those at the start."""
        return self._prescribed

    def _mutual_reference(self, context: Context) -> Array:
        motion = np.zeros(FRAME_MOTION_SIZE)
        motion[:POSE_SIZE] = self._mutual_pose(context)
        return motion

    def _calc_references(self, context: Context, value: AbstractValue) -> None:
        C = self._compliant.Eval(context)
        if not self._is_motion(C):
            check_frame_motion(C, f"{self.get_name()}:compliant_motion")
        hands = np.empty((2, FRAME_MOTION_SIZE))
        if not self._mutual.HasValue(context):
            self._rigid(C, self._mutual_pose(context), hands)
            value.set_value(hands)
            return
        mutual = self._mutual.Eval(context)
        if not self._is_motion(mutual):
            check_frame_motion(mutual, f"{self.get_name()}:mutual_motion")
        check_half_defined(mutual)
        self._moving(C, mutual, hands)
        value.set_value(hands)


def measured_mutual_pose(system: str, first: Array, second: Array) -> Array:
    """Returns ¹Q_21 and ᵒΔp_21 (7,) that two hands have.

    Args:
        system: the name in an error.
        first: motion of the first hand (19,), in W.
        second: the same of the second (19,).

    Raises:
        SignalError: a motion is not finite, or its quaternion is not unit.
        OutOfDomainError: the hands are turned by more than 355° against each other.
    """
    check_frame_motion(first, f"{system}:measured_motion_1")
    check_frame_motion(second, f"{system}:measured_motion_2")
    Q_W1 = first[QUATERNION]
    Q_12 = mutual_pose.mutual_orientation_at_start(Q_W1, second[QUATERNION])
    check_half_defined(Q_12)
    R_WO = quaternion.to_rotation(absolute_pose.absolute_orientation(Q_W1, Q_12))
    p_12_W = mutual_pose.mutual_position(first[POSITION], second[POSITION])
    return np.concatenate((quaternion.normalized(Q_12), R_WO.T @ p_12_W))
