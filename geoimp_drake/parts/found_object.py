"""The results of the laws of a held object, and the outputs that follow from them."""

from collections.abc import Callable
from typing import Any

import numpy as np

from geoimp_drake.compilation.compiled import bound
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE, FRAME_STATE_SIZE, POSE_SIZE
from geoimp_drake.parts.law_signals import ArmSignals, KeptGains
from geoimp_drake.parts.part import NOTHING, Now
from geoimp_drake.typing import Array

__all__ = ["FoundObject", "write_pose", "written_motion", "written_wrench"]

_Pair = tuple[Array, Array]


class FoundObject:
    """The inputs and results of one evaluation of the law, in persistent arrays.

    Args:
        law: see laws/compositions/object_control.py.
        gains: those of the object's impedance.
        constants: the law's arguments after the gains.
        arms: by an arm's number, the signals of its laws.

    Attributes:
        law: writes the next four attributes.
        motions: (6, 19), see there.
        wrenches: (3, 6), see there.
        rates: of the state (26).
        state: of C and of the mutual pose, as in the motions (26).
        pose: ¹Q_21 and ᵒΔp_21 of the grasp (7).
        memory: of the whole part, with readings; before the first ones, those of the ports.
        hand_wrenches: of both hands (6).
        arms: see above.
        torques: by an arm's number, the time of its torques, its `null_space_decay_bound` and its
            `Limited`.
    """

    __slots__ = (
        "_desired",
        "_gains",
        "_hands",
        "_reference",
        "arms",
        "hand_wrenches",
        "law",
        "memory",
        "motions",
        "pose",
        "rates",
        "state",
        "torques",
        "wrenches",
    )

    def __init__(
        self,
        law: Callable[..., bool],
        gains: tuple[Array, ...],
        constants: tuple[Any, ...],
        arms: dict[int, ArmSignals],
    ):
        self.arms, self.memory, self._gains = arms, NOTHING, KeptGains(gains)
        self.motions = np.zeros((6, FRAME_MOTION_SIZE))
        self.wrenches = np.zeros((3, 6))
        self.rates, self.state = np.zeros((2, 2 * FRAME_STATE_SIZE))
        self.pose = np.zeros(POSE_SIZE)
        self._hands: _Pair = np.zeros(FRAME_MOTION_SIZE), np.zeros(FRAME_MOTION_SIZE)
        self.hand_wrenches: _Pair = np.zeros(6), np.zeros(6)
        self._desired, self._reference = np.zeros((2, FRAME_MOTION_SIZE))
        taken = *self._hands, *self.hand_wrenches, self._desired, self.state, self.pose
        found = self._reference, self.motions, self.wrenches, self.rates
        self.law = bound(law, *taken, *found, *self._gains.arrays, *constants)
        self.torques: dict[int, tuple[float, float, Array]] = {}

    def take(
        self,
        hands: _Pair,
        wrenches: _Pair,
        desired: Array,
        state: Array,
        reference: Array,
        gains: tuple[Array, ...],
    ) -> None:
        """Copies the inputs of one evaluation except the pose; arguments as of the law."""
        for own, given in zip(self._hands + self.hand_wrenches, hands + wrenches, strict=True):
            own[:] = given
        self._desired[:], self.state[:], self._reference[:] = desired, state, reference
        self._gains.take(gains)


def written_motion(row: int) -> Callable[[Now, Array], None]:
    """Returns the function that writes a row of `FoundObject.motions`."""

    def write(now: Now, value: Array) -> None:
        value[:] = now.found.motions[row]

    return write


def written_wrench(row: int) -> Callable[[Now, Array], None]:
    """Returns the function that writes a row of `FoundObject.wrenches`."""

    def write(now: Now, value: Array) -> None:
        value[:] = now.found.wrenches[row]

    return write


def write_pose(now: Now, value: Array) -> None:
    """Writes the pose of the grasp as a motion at rest (19,)."""
    value[:] = 0.0
    value[:POSE_SIZE] = now.found.pose
