"""The pose of a peg relative to its hole."""

from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform

__all__ = ["Insertion", "insertion"]


class Insertion(NamedTuple):
    """The pose of a peg, seen from its hole."""

    depth: float  # [m] of the centre of the tip behind the mouth, along the hole's axis
    offset: float  # [m] of the centre of the tip from the hole's axis
    angle: float  # [rad] between the two axes, zero to π


def insertion(X_WP: RigidTransform, X_WH: RigidTransform) -> Insertion:
    """Returns depth, offset and angle of a peg.

    Args:
        X_WP: of the peg; P at the centre of its tip, z out of the tip.
        X_WH: of the hole; H at the centre of its mouth, z out of the hole.
    """
    X_HP = X_WH.inverse() @ X_WP
    x, y, z = X_HP.translation()
    a = X_HP.rotation().col(2)
    return Insertion(float(-z), float(np.hypot(x, y)), float(np.arctan2(np.hypot(*a[:2]), -a[2])))
