"""The inertia that a wrist sensor carries, and the arm behind it; floats only, at build time.

The eigenvalues of Λ⁻¹ M_t, where Λ is the arm's inertia at E, tool included, lie between zero and
one. The largest is the share of the moving inertia that lies beyond the sensor.
`geoimp_drake.laws.prediction.sampled_loop` has the effect on the loop of a reading that still
contains the tool's inertial load.
"""

from dataclasses import dataclass

import numpy as np

from geoimp_drake.typing import Array

__all__ = ["SensedInertia"]


@dataclass(frozen=True)
class SensedInertia:
    """The inertia that a sensor carries and the arm behind it, in one posture, all at E in W."""

    mobility: Array  # Λ⁻¹ = J B⁻¹ Jᵀ (6×6)
    tool: Array  # M_t, spatial inertia beyond the sensor (6×6)
    R_WE: Array  # (3×3)
    time_step: float  # of the plant, zero if it is continuous [s]

    def share(self) -> float:
        """Returns the largest eigenvalue of Λ⁻¹ M_t: the share of the inertia beyond the sensor."""
        return float(np.linalg.eigvals(self.mobility @ self.tool).real.max())
