"""Rotations given by a direction."""

import numpy as np
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RotationMatrix

from geoimp_drake.typing import Array

__all__ = ["least_turn_from_z"]


def least_turn_from_z(direction: Array) -> RotationMatrix:
    """Returns the smallest rotation that turns z into a direction; about x if that is -z."""
    x, y, z = direction
    axis = np.array([-y, x, 0.0]) if x or y else np.array([1.0, 0.0, 0.0])
    return RotationMatrix(AngleAxis(np.arctan2(np.hypot(x, y), z), axis / np.linalg.norm(axis)))
