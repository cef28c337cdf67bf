"""How D meets a wall, and metrics of the contact force, of a run or of a rollout of the law."""

from dataclasses import dataclass

import numpy as np
from pydrake.trajectories import PiecewisePolynomial

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.simulation.claims import last_second
from geoimp_drake.typing import Array

__all__ = ["METRICS", "Encounter", "contact_metrics"]

# The metrics of `contact_metrics`, with units.
METRICS = {"peak_force": "N", "steady_force": "N", "settling": "s"}

# The force counts as settled within this fraction of the force at rest.
_BAND = 0.02
# D rests when it is slower than this [m/s].
_REST = 1e-4


@dataclass(frozen=True)
class Encounter:
    """How D meets a wall, along the wall's normal.

    Attributes:
        times: of the steps (n) [s].
        motion: of D relative to the undeformed wall, positive behind it: position, velocity,
            acceleration, one row per step (n, 3).
        normal: of the wall, [rotation; translation] in W (6), a unit vector.
        hands: number of hands that press together.
    """

    times: Array
    motion: Array
    normal: Array
    hands: int = 1

    @classmethod
    def of_depths(
        cls, times: Array, depths: Array, step: float, normal: Array, hands: int = 1
    ) -> "Encounter":
        """Returns the encounter of depths (n) [m] at times (n) [s], which a spline interpolates.

        Args:
            times: of a log.
            depths: of D behind the undeformed wall.
            step: of the plant [s].
            normal: of the wall (3), in W.
            hands: number of hands that press together.

        Raises:
            ConfigurationError: D reaches no wall, or does not rest behind it at the end.
        """
        path = PiecewisePolynomial.CubicWithContinuousSecondDerivatives(times, depths[None])
        every = np.arange(0.0, times[-1], step)
        motion = [path, path.derivative(1), path.derivative(2)]
        rows = np.column_stack([part.vector_values(every)[0] for part in motion])
        found = cls(every, np.ascontiguousarray(rows), np.append(np.zeros(3), normal), hands)
        if depths[-1] <= 0.0 or found.rest >= times[-1] - 1.0:
            raise ConfigurationError(
                f"The desired motion ends {1e3 * depths[-1]:.4g} mm behind the wall, at rest for "
                f"{times[-1] - found.rest:.3g} s; a tuning needs a motion that presses on a wall "
                f"and rests there for more than 1 s."
            )
        return found

    @property
    def touch(self) -> float:
        """The time from which D stays in the wall [s]."""
        return self._last(self.motion[:, 0] <= 0.0)

    @property
    def rest(self) -> float:
        """The time at which D has come to rest [s]."""
        return self._last(np.abs(self.motion[:, 1]) > _REST)

    def _last(self, mask: Array) -> float:
        return float(self.times[np.flatnonzero(mask)[-1]]) if mask.any() else 0.0


def contact_metrics(times: Array, force: Array, touch: float) -> dict[str, float]:
    """Returns `peak_force` and `steady_force` [N], and `settling` [s].

    Settling is the time from when D is in the wall until the force stays within 2 % of its mean
    over the last second. It is infinite if the force does not settle.

    Args:
        times: of the samples (n) [s].
        force: on the wall (n) [N].
        touch: when D is in the wall [s].
    """
    steady = float(force[last_second({"t": times})].mean())
    outside = np.flatnonzero(np.abs(force - steady) > _BAND * abs(steady))
    last = int(outside[-1]) + 1 if outside.size else 0
    settled = float(times[last]) - touch if steady > 0.0 and last < len(times) else np.inf
    return {"peak_force": float(force.max()), "steady_force": steady, "settling": settled}
