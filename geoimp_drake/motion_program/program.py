"""A motion program as plain data: moves one after another, each from rest to rest."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from pydrake.math import RigidTransform

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.typing import Array
from geoimp_drake.validation import finite_vector

__all__ = [
    "JointMove",
    "LinearMove",
    "MotionProgram",
    "SpeedOverride",
    "Step",
    "ToolMove",
    "check_override",
]


@dataclass
class JointMove:
    """Straight in joint space: all joints start and stop together."""

    target: Array  # joint positions from the base to the hand (n) [rad or m]
    name: str = "joint move"
    place: str = ""  # in the program's text, for errors

    def validate(self) -> None:
        """Raises ConfigurationError if a field cannot be used."""
        finite_vector(self.target, f"The target of {self.name}", np.size(self.target))


@dataclass
class LinearMove:
    """Tool frame T to a pose: its origin along a straight line, its attitude about one axis."""

    X_WT: RigidTransform
    name: str = "linear move"
    place: str = ""

    def validate(self) -> None:
        """Raises ConfigurationError if a field cannot be used."""
        finite_vector(self.X_WT.translation(), f"The target of {self.name}", 3)


@dataclass
class ToolMove:
    """Straight move by a displacement in the tool frame T as it is when the move starts."""

    displacement: Array = field(default_factory=lambda: np.zeros(3))  # in T [m]
    name: str = "tool move"
    place: str = ""

    def validate(self) -> None:
        """Raises ConfigurationError if a field cannot be used."""
        finite_vector(self.displacement, f"The displacement of {self.name}", 3)


@dataclass
class SpeedOverride:
    """Scales speeds and accelerations of the following moves, in per cent of the nominal ones."""

    percent: float = 100.0  # 1 … 100
    place: str = ""

    def validate(self) -> None:
        """Raises ConfigurationError unless the override is between 1 and 100 per cent."""
        check_override(self.percent)


Step = JointMove | LinearMove | ToolMove | SpeedOverride


@dataclass
class MotionProgram:
    """Moves and speed overrides in their order; the override is 100 per cent at first."""

    steps: Sequence[Step] = ()
    name: str = "program"

    def validate(self) -> None:
        """Raises ConfigurationError if a step cannot be used."""
        for step in self.steps:
            step.validate()


def check_override(percent: float) -> None:
    """Raises ConfigurationError unless a speed override is between 1 and 100 per cent."""
    if not 1 <= percent <= 100:
        raise ConfigurationError(
            f"The speed override is {percent:g} %; give one from 1 to 100 per cent."
        )
