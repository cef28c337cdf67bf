"""The grasp's mutual pose: that of the second hand relative to the first."""

from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.cooperation import absolute_pose, mutual_pose
from geoimp_drake.laws.cooperation.half_rotation import check_half_defined
from geoimp_drake.laws.cooperation.hand_references import moving_references, rigid_references
from geoimp_drake.laws.frame_motion import (
    FRAME_MOTION_SIZE,
    POSE_SIZE,
    POSITION,
    QUATERNION,
    is_frame_motion,
)
from geoimp_drake.parts.part import Memory, Now, Output
from geoimp_drake.parts.signals import check_frame_motion, is_set
from geoimp_drake.rotations import quaternion
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, finite_vector, key

__all__ = ["GraspPose", "HandReferences", "MutualPose"]


@dataclass
class MutualPose:
    """The second hand's pose relative to the first, from the grasp's geometry and calibration."""

    quaternion: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))  # ¹Q_21
    position: Array = field(default_factory=lambda: np.array([0.0, 1.0, 0.0]))  # ᵒΔp_21 [m]

    def validate(self, name: str) -> None:
        """Raises an error if a field cannot be used.

        Raises:
            ConfigurationError: a number is not finite, or a vector has another length.
            SignalError: the quaternion is not unit.
        """
        finite_vector(self.position, key(name, "position"), 3)
        quaternion.check_unit(
            finite_vector(self.quaternion, key(name, "quaternion"), 4), key(name, "quaternion")
        )

    def pose(self) -> Array:
        """Returns ¹Q_21 and ᵒΔp_21 (7), with the sign of ¹Q_21 that decides where O is."""
        Q = np.asarray(self.quaternion, dtype=float)
        Q_12 = mutual_pose.mutual_orientation_at_start(np.array([1.0, 0.0, 0.0, 0.0]), Q)
        return np.concatenate((quaternion.normalized(Q_12), self.position))


class GraspPose:
    """Remembers the mutual pose of the grasp from the first step on, (4.7), (4.8), as (7,).

    ¹Q_21 is the orientation of the second hand in the first. ᵒΔp_21 is the position of the second
    hand from the first, in the axes of O.

    Args:
        prescribed: the mutual pose; by default that of the measured motions at the start.
    """

    def __init__(self, prescribed: MutualPose | None = None):
        if prescribed is not None:
            check(prescribed, "mutual_pose")
        self._prescribed = None if prescribed is None else prescribed.pose()
        # Zero, quaternion included: no pose has been taken yet.
        self.memory = Memory(pose=np.zeros(POSE_SIZE))

    def pose(self, memory: Array, now: Now, first: Array, second: Array) -> Array:
        """Returns the pose (7,): what is remembered, prescribed or measured.

        Args:
            memory: of this object (7,).
            now: names the ports `measured_motion_1` and `measured_motion_2`.
            first: motion of the first hand (19,), in W.
            second: the same of the second (19,).

        Raises:
            SignalError: a motion is not finite, or its quaternion is not unit.
            OutOfDomainError: the hands are turned by more than 355° against each other.
        """
        if is_set(memory):
            return memory
        if self._prescribed is not None:
            return self._prescribed
        check_frame_motion(first, now.port("measured_motion_1"))
        check_frame_motion(second, now.port("measured_motion_2"))
        Q_W1 = first[QUATERNION]
        Q_12 = mutual_pose.mutual_orientation_at_start(Q_W1, second[QUATERNION])
        check_half_defined(Q_12)
        R_WO = quaternion.to_rotation(absolute_pose.absolute_orientation(Q_W1, Q_12))
        p_12_W = mutual_pose.mutual_position(first[POSITION], second[POSITION])
        return np.concatenate((quaternion.normalized(Q_12), R_WO.T @ p_12_W))


class HandReferences:
    """The part of `CooperativeReferenceGenerator`.

    Args:
        grasp: the mutual pose of the grasp.
    """

    float_only = "finds its motions in arrays of floats"

    def __init__(self, grasp: GraspPose):
        self._grasp = grasp
        self._rigid, self._moving = compiled(rigid_references), compiled(moving_references)
        self._is_motion = compiled(is_frame_motion)
        names = "compliant_motion", "measured_motion_1", "measured_motion_2", "mutual_motion"
        self.inputs = dict.fromkeys(names, FRAME_MOTION_SIZE)
        self.memory = self._grasp.memory
        start = "memory", "measured_motion_1", "measured_motion_2"
        self.found_of = (*start, "compliant_motion", "mutual_motion")
        self.outputs = (
            Output("reference_motion_1", FRAME_MOTION_SIZE, _write_first, ("found",)),
            Output("reference_motion_2", FRAME_MOTION_SIZE, _write_second, ("found",)),
            Output("mutual_reference", FRAME_MOTION_SIZE, self._write_pose, start),
        )

    def settle(self, memory: Array, now: Now) -> None:
        """Remembers the grasp at the start, after the joints have been read."""
        memory[:] = self._pose(memory, now)

    def new_found(self) -> Array:
        """Returns an array for the motions of both hands (2, 19)."""
        return np.empty((2, FRAME_MOTION_SIZE))

    def find(self, now: Now, found: Array) -> None:
        """Writes the motions of both hands, (4.10)-(4.15).

        Raises:
            SignalError: a motion is not finite, or its quaternion is not unit.
            OutOfDomainError: the references turn by more than 355° against each other.
        """
        C = now["compliant_motion"]
        if not self._is_motion(C):
            check_frame_motion(C, now.port("compliant_motion"))
        if not now.has("mutual_motion"):
            self._rigid(C, self._pose(now.memory, now), found)
            return
        mutual = now["mutual_motion"]
        if not self._is_motion(mutual):
            check_frame_motion(mutual, now.port("mutual_motion"))
        check_half_defined(mutual)
        self._moving(C, mutual, found)

    def _pose(self, memory: Array, now: Now) -> Array:
        if is_set(memory):
            return memory
        hands = now["measured_motion_1"], now["measured_motion_2"]
        return self._grasp.pose(memory, now, *hands)

    def _write_pose(self, now: Now, motion: Array) -> None:
        motion[:] = 0.0
        motion[:POSE_SIZE] = self._pose(now.memory, now)


def _write_first(now: Now, motion: Array) -> None:
    motion[:] = now.found[0]


def _write_second(now: Now, motion: Array) -> None:
    motion[:] = now.found[1]
