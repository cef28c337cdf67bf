"""What an arm's inner loop works with besides its signals."""

from typing import Any

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.dynamics import Scratch
from geoimp_drake.parts.joint_readings import Readings
from geoimp_drake.typing import Array

__all__ = ["ArmWorkspace"]


class ArmWorkspace(Scratch):
    """A context of the arm's plant, and where a reading of its joints is taken.

    Args:
        model: the arm.
        readings: how the joints are read.
        arrays: of input and memory, if they persist, see `Readings.new_workspace`.
    """

    def __init__(self, model: ControlModel, readings: Readings, *arrays: Array):
        super().__init__(model)
        self._readings, self.reading = readings, readings.new_workspace(*arrays)

    def __deepcopy__(self, memo: dict[int, Any]) -> "ArmWorkspace":
        return ArmWorkspace(self.model, self._readings)
