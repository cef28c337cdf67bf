"""The motion that a signal had when the last step began, remembered."""

from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE
from geoimp_drake.parts.part import Memory, Now, held
from geoimp_drake.parts.signals import AT_REST
from geoimp_drake.typing import Array

__all__ = ["KeptMotion"]


class KeptMotion:
    """The part of `LastMotion`."""

    float_only = "holds a motion step by step"

    def __init__(self) -> None:
        self.inputs = {"motion": FRAME_MOTION_SIZE}
        self.memory = Memory(last=AT_REST)
        self.outputs = (held("last_motion", self.memory.last),)

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Keeps the motion."""
        memory[:] = now["motion"]
