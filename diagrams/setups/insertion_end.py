"""Ends an insertion before its plan does: the peg is in, or the cell stops."""

from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import Context, EventStatus

from geoimp_drake.diagrams.scene.insertion import insertion
from geoimp_drake.systems.frame_motion import frame_motion_vector, pose_of
from geoimp_drake.systems.part_system import Block
from geoimp_drake.validation import key, positive

__all__ = ["InsertionEnd", "InsertionWatch"]


@dataclass
class InsertionEnd:
    """When the rest of an insertion would tell nothing more, and the run ends."""

    depth: float = 0.045  # of the peg's tip behind the mouth, at which the peg is in [m]
    force: float = 130.0  # on the hand, at which the cell stops [N]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        positive(self.depth, key(name, "depth"), "m")
        positive(self.force, key(name, "force"), "N")


class InsertionWatch(Block):
    """Ends the simulation when an insertion has ended; it checks whenever a row is logged.

    Args:
        end: of the insertion.
        period: of the log [s].

    Ports:
        input motion_P: of the peg's tip in W (19)
        input motion_H: of the hole's mouth in W (19)
        input wrench: true, on the environment (6) [Nm, N]
    """

    def __init__(self, end: InsertionEnd, period: float):
        super().__init__()
        self._end = end
        self._P, self._H = (
            self.DeclareVectorInputPort(f"motion_{frame}", frame_motion_vector()) for frame in "PH"
        )
        self._wrench = self.DeclareVectorInputPort("wrench", 6)
        self.DeclarePeriodicPublishEvent(period, 0.0, self._look)

    def _look(self, context: Context) -> EventStatus:
        depth = insertion(*(pose_of(port.Eval(context)) for port in (self._P, self._H))).depth
        force = np.linalg.norm(self._wrench.Eval(context)[3:])
        if depth >= self._end.depth or force >= self._end.force:
            return EventStatus.ReachedTermination(self, "the insertion has ended")
        return EventStatus.Succeeded()
