"""Motion and wrench of an object, from the two hands that hold it."""

from collections.abc import Callable
from functools import partial

import numpy as np

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.cooperation.half_rotation import check_half_defined
from geoimp_drake.laws.cooperation.held_object import held_object_motion, held_object_wrenches
from geoimp_drake.laws.cooperation.object_slack import object_slack
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE, QUATERNION, is_finite, is_frame_motion
from geoimp_drake.parts.hold_back import NO_SLACK
from geoimp_drake.parts.object_load import LoadArguments
from geoimp_drake.parts.part import Memory, Now, Output
from geoimp_drake.parts.signals import check_frame_motion, check_signal
from geoimp_drake.typing import Array

__all__ = ["ObjectKinematics"]

Found = tuple[Array, Array]


class ObjectKinematics:
    """The part of `CooperativeKinematics`.

    Args:
        load: how the object's wrench follows from those of the hands.
    """

    float_only = "finds its motions in arrays of floats"

    def __init__(self, load: LoadArguments):
        self._load = load.arguments
        self._at_rest = np.zeros(FRAME_MOTION_SIZE)
        self._motion_law = compiled(held_object_motion)
        self._wrench_law = compiled(held_object_wrenches)
        self._slack_law = compiled(object_slack)
        self._is_motion, self._is_finite = compiled(is_frame_motion), compiled(is_finite)
        self.inputs = {
            "motion_1": FRAME_MOTION_SIZE,
            "motion_2": FRAME_MOTION_SIZE,
            "wrench_1": 6,
            "wrench_2": 6,
            "mutual_reference": FRAME_MOTION_SIZE,
            "reference_motion": FRAME_MOTION_SIZE,
        }
        self.found_of = tuple(self.inputs)
        self.inputs |= {"slack_1": 6, "slack_2": 6}
        self.memory = Memory()
        slacks = "found", "motion_1", "slack_1", "slack_2"
        self.outputs = (
            _output("object_motion", FRAME_MOTION_SIZE, lambda found: found[0][0]),
            _output("object_wrench", 6, lambda found: found[1][0]),
            _output("internal_wrench", 6, lambda found: found[1][1]),
            _output("mutual_motion", FRAME_MOTION_SIZE, lambda found: found[0][1]),
            _output("mutual_wrench", 6, lambda found: found[1][2]),
            Output("object_slack", 6, partial(self._write_slack, 0), slacks),
            Output("mutual_slack", 6, partial(self._write_slack, 1), slacks),
        )

    def new_found(self) -> Found:
        """Returns arrays for motions (2, 19) and wrenches (3, 6)."""
        return np.empty((2, FRAME_MOTION_SIZE)), np.empty((3, 6))

    def find(self, now: Now, found: Found) -> None:
        """Writes the motions of O and of the mutual pose, and the wrenches, (4.1)-(4.9).

        Raises:
            SignalError: an input is NaN or infinite, or a quaternion is not unit.
            OutOfDomainError: the hands have turned by more than 355° against each other.
        """
        motions, wrenches = found
        first, second = now["motion_1"], now["motion_2"]
        if not (self._is_motion(first) and self._is_motion(second)):
            check_frame_motion(first, now.port("motion_1"))
            check_frame_motion(second, now.port("motion_2"))
        self._motion_law(first, second, now["mutual_reference"][QUATERNION], motions)
        check_half_defined(motions[1])
        h_1, h_2 = now["wrench_1"], now["wrench_2"]
        if not (self._is_finite(h_1) and self._is_finite(h_2)):
            check_signal(h_1, now.port("wrench_1"))
            check_signal(h_2, now.port("wrench_2"))
        # The motion whose inertial load is removed; without one, only the weight is removed.
        reference = self._at_rest
        if now.has("reference_motion"):
            reference = now["reference_motion"]
            if not self._is_finite(reference):
                check_signal(reference, now.port("reference_motion"))
        self._wrench_law(h_1, h_2, first[QUATERNION], motions, *self._load, reference, wrenches)

    def _write_slack(self, row: int, now: Now, value: Array) -> None:
        """Writes the slack (6,) of the object, row 0, or of the mutual pose, row 1."""
        first, second = (
            now[name] if now.has(name) else NO_SLACK for name in ("slack_1", "slack_2")
        )
        if not (np.count_nonzero(first) or np.count_nonzero(second)):
            value[:] = 0.0
            return
        slacks = np.empty((2, 6))
        self._slack_law(now["motion_1"][QUATERNION], now.found[0], first, second, slacks)
        value[:] = slacks[row]


def _output(name: str, size: int, part: Callable[[Found], Array]) -> Output:
    def write(now: Now, value: Array) -> None:
        value[:] = part(now.found)

    return Output(name, size, write, ("found",))
