"""Taught variables of a motion program as plain data, for scenario files."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.rotations import euler
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, finite_vector, key

__all__ = ["TaughtVariable", "taught_values"]


@dataclass
class TaughtVariable:
    """A joint position (`joints`) or the pose of the tool frame (`position`, `attitude_deg`)."""

    name: str = "variable"
    joints: Array | None = None  # from the base to the hand [rad or m]
    position: Array | None = None  # of the tool frame's origin, in W [m]
    attitude_deg: Array = field(default_factory=lambda: np.zeros(3))  # XYZ Euler angles

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        if (self.joints is None) == (self.position is None):
            given = "both" if self.joints is not None else "none"
            raise ConfigurationError(
                f"{name or 'variable'} '{self.name}' has {given} of joints and position; give one "
                f"of them."
            )
        if self.joints is not None:
            finite_vector(self.joints, key(name, "joints"), np.size(self.joints))
        if self.position is not None:
            finite_vector(self.position, key(name, "position"), 3)
        finite_vector(self.attitude_deg, key(name, "attitude_deg"), 3)

    def value(self) -> Array | RigidTransform:
        """Returns the joint positions, or the pose X_WT."""
        if self.joints is not None:
            return np.asarray(self.joints, dtype=float)
        R_WT = euler.to_rotation(np.deg2rad(self.attitude_deg))
        return RigidTransform(RotationMatrix.ProjectToRotationMatrix(R_WT), self.position)


def taught_values(
    variables: Iterable[TaughtVariable], name: str = "taught"
) -> dict[str, Array | RigidTransform]:
    """Returns the values of taught variables by name.

    Args:
        variables: those that were taught.
        name: of their list, for errors.

    Raises:
        ConfigurationError: a variable cannot be used, or a name is taught twice.
    """
    values: dict[str, Array | RigidTransform] = {}
    for index, variable in enumerate(variables):
        check(variable, f"{name}.{index}")
        if variable.name in values:
            raise ConfigurationError(f"'{variable.name}' is taught twice in {name}; leave one out.")
        values[variable.name] = variable.value()
    return values
