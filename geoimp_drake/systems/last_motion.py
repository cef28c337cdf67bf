"""The motion that a signal had when the last step began, as a held state."""

from geoimp_drake.parts.last_motion import KeptMotion
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["LastMotion"]


class LastMotion(PartSystem):
    """Holds a frame motion as it was when the last step began.

    A reaction force belongs to the step that caused it. So does the motion whose inertial load is
    to be removed from it: see `ForceTorqueSensor`, `reference_is_held`.

    Ports:
        input motion: of a frame, in W (19)
        output last_motion: the same when the last step began; no direct feedthrough (19)
    """

    def __init__(self) -> None:
        super().__init__(KeptMotion())
