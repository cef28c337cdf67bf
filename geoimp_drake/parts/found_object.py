"""What the laws of a held object find, and the outputs that follow."""

from collections.abc import Callable

import numpy as np

from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE, FRAME_STATE_SIZE, POSE_SIZE
from geoimp_drake.parts.law_signals import ArmSignals
from geoimp_drake.parts.part import NOTHING, Now
from geoimp_drake.typing import Array

__all__ = ["FoundObject", "write_pose", "written_motion", "written_wrench"]

_NO_WRENCH = np.zeros(6)


class FoundObject:
    """The results of one evaluation of the law, and the memory and inputs that it used.

    Attributes:
        motions: (6, 19), see laws/compositions/object_control.py.
        wrenches: (3, 6), see there.
        rates: of the state (26).
        state: that of the motions (26).
        pose: of the grasp (7).
        memory: of the whole part, with what has passed through.
        hand_wrenches: of both hands (6).
        arms: of an arm's number: what its laws take and find.
        torques: of an arm's number: the time of its torques, its `null_space_decay_bound` and its
            `Limited`.
    """

    __slots__ = (
        "arms",
        "hand_wrenches",
        "memory",
        "motions",
        "pose",
        "rates",
        "state",
        "torques",
        "wrenches",
    )

    def __init__(self, arms: dict[int, ArmSignals] | None = None):
        self.arms = arms or {}
        self.motions = np.zeros((6, FRAME_MOTION_SIZE))
        self.wrenches = np.zeros((3, 6))
        self.rates = np.empty(2 * FRAME_STATE_SIZE)
        self.state = self.pose = self.memory = NOTHING
        self.hand_wrenches = _NO_WRENCH, _NO_WRENCH
        self.torques: dict[int, tuple[float, float, Array]] = {}


def written_motion(row: int) -> Callable[[Now, Array], None]:
    """Returns what writes one of the motions."""

    def write(now: Now, value: Array) -> None:
        value[:] = now.found.motions[row]

    return write


def written_wrench(row: int) -> Callable[[Now, Array], None]:
    """Returns what writes one of the wrenches."""

    def write(now: Now, value: Array) -> None:
        value[:] = now.found.wrenches[row]

    return write


def write_pose(now: Now, value: Array) -> None:
    """Writes the pose of the grasp as a motion."""
    value[:] = 0.0
    value[:POSE_SIZE] = now.found.pose
