"""The masses of an impedance, and their matrix in the world."""

from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.laws.impedance.translational_impedance import turned
from geoimp_drake.typing import Array

__all__ = ["Masses"]


@dataclass(frozen=True)
class Masses:
    """M_o, in C's axes, and M_p, in W's or in D's; unit matrices by default."""

    rotation: Array = field(default_factory=lambda: np.eye(3))  # M_o (3×3) [kg m²]
    translation: Array = field(default_factory=lambda: np.eye(3))  # M_p (3×3) [kg]
    in_desired: bool = False  # whether M_p is in D's axes

    def in_world(self, R_WC: Array, R_WD: Array) -> Array:
        """Returns the mass matrix in W (6, 6), [angular; linear].

        Args:
            R_WC: attitude of C (3, 3).
            R_WD: of D (3, 3).
        """
        M = np.zeros((6, 6))
        M[:3, :3] = turned(self.rotation, R_WC)
        M[3:, 3:] = turned(self.translation, R_WD) if self.in_desired else self.translation
        return M
