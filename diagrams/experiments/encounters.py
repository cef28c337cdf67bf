"""How the hand of an experiment meets the surface that it presses on, from a log."""

from typing import Any

import numpy as np

from geoimp_drake.analysis.encounter import Encounter
from geoimp_drake.diagrams.experiments.measures import Log, true_wrench
from geoimp_drake.diagrams.setups.tight_scenario import ARMS, OBJECT
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.frame_motion import POSITION, QUATERNION
from geoimp_drake.typing import Array

__all__ = ["contact_force", "encounter"]


def contact_force(log: Log, scenario: Any) -> Array:
    """Returns the size of the true force of the compliant hand or object over time (N) [N]."""
    force: Array = np.linalg.norm(true_wrench(log, scenario.compliant)[:, 3:], axis=1)
    return force


def encounter(log: Log, scenario: Any, step: float) -> Encounter:
    """Returns how the disk, where D would have it, meets the surface.

    Raises:
        ConfigurationError: there is no surface, or D does not rest behind it.
    """
    arm = scenario.compliant
    if "surface/plane" not in log:
        raise ConfigurationError(
            f"{scenario.experiment} has no surface that the hand meets, so there is no contact to "
            f"tune; give the scenario a surface, or take plexiglas, bar or peg_in_hole."
        )
    n, offset = log["surface/plane"][:3], log["surface/plane"][3]
    D, C = (log[f"{arm}/motion_{frame}"] for frame in "DC")
    turned = [quaternion.to_rotation(Q_WC) @ log["surface/disk"] for Q_WC in C[:, QUATERNION]]
    depths = offset - (D[:, POSITION] + np.array(turned)) @ n
    return Encounter.of_depths(log["t"], depths, step, n, len(ARMS) if arm == OBJECT else 1)
