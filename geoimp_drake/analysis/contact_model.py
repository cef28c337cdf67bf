"""Gains along a wall's normal, and their behaviour in a rollout of the law."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from geoimp_drake.analysis.encounter import Encounter, contact_metrics
from geoimp_drake.analysis.report import TRANSLATION
from geoimp_drake.analysis.ringing import largest_stiffness, on_surface, rings
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.prediction.contact_rollout import along, contact_rollout
from geoimp_drake.laws.prediction.sampled_loop import SampledLoop
from geoimp_drake.typing import Array

__all__ = ["GAINS", "ROBUSTNESS", "ContactModel", "Gains"]

# The key of the scenario and the unit, by the chapter's letter.
GAINS = {"M": ("mass", "kg"), "D": ("damping", "Ns/m"), "K": ("stiffness", "N/m")}

# The predictor's result for a hand, besides `contact_metrics`.
ROBUSTNESS = "largest_surface_stiffness"

# The number of walls that a search tries.
_LOOKED_AT = 4

# M, D, K along the wall's normal, by letter.
Gains = Mapping[str, float]


@dataclass(frozen=True)
class ContactModel:
    """A hand that meets a wall, with gains of translation that can be varied.

    Attributes:
        loop: of one hand, with the gains as given, on the experiment's wall.
        encounter: how D meets the wall.
    """

    loop: SampledLoop
    encounter: Encounter

    @cached_property
    def given(self) -> dict[str, float]:
        """M, D, K along the normal, of all hands."""
        n, loop = self.encounter.normal, self.loop
        softness = n @ loop.mass_inverse @ n
        mass = 1.0 / softness if softness > 0.0 else np.inf
        gains = mass, n @ loop.damping @ n, n @ loop.stiffness @ n
        hands = self.encounter.hands
        return {name: float(hands * gain) for name, gain in zip(GAINS, gains, strict=True)}

    @property
    def wall(self) -> float:
        """Stiffness of the experiment's wall [N/m]."""
        n = self.encounter.normal
        return float(self.encounter.hands * (n @ self.loop.environment @ n))

    def with_gains(self, gains: Gains) -> SampledLoop:
        """Returns the loop with other gains, whose axes and ratios are those of the given ones."""
        factor = {name: gains[name] / self.given[name] for name in gains}
        return replace(
            self.loop,
            mass_inverse=_scaled(self.loop.mass_inverse, 1.0 / factor.get("M", 1.0)),
            damping=_scaled(self.loop.damping, factor.get("D", 1.0)),
            stiffness=_scaled(self.loop.stiffness, factor.get("K", 1.0)),
        )

    def force(self, gains: Gains, wall: float | None = None) -> Array:
        """Returns the force of all hands on a wall over the encounter's times (n) [N].

        Args:
            gains: along the normal.
            wall: stiffness of an undamped wall [N/m]; None for the experiment's wall.
        """
        loop, hands = self.with_gains(gains), self.encounter.hands
        if wall is not None and wall != self.wall:
            loop = on_surface(loop, wall / hands)
        force = np.empty(len(self.encounter.times))
        compiled(contact_rollout)(along(loop, self.encounter.normal), self.encounter.motion, force)
        return hands * force

    def metrics(self, gains: Gains, wall: float | None = None) -> dict[str, float]:
        """Returns `contact_metrics` of `force`."""
        times, touch = self.encounter.times, self.encounter.touch
        return contact_metrics(times, self.force(gains, wall), touch)

    def quiet_up_to(self, gains: Gains, stiffest: float) -> float:
        """Returns the last of a few walls before one that rings, infinite if none does [N/m].

        This is quicker than `largest_surface_stiffness`, and fine enough for a search.
        """
        loop, hands = self.with_gains(gains), self.encounter.hands
        walls = np.geomspace(min(self.wall, stiffest), stiffest, _LOOKED_AT)
        along_normal = np.outer(self.encounter.normal, self.encounter.normal)
        bare = replace(loop, environment_damping=0.0 * along_normal)
        quiet = 0.0
        for wall in walls:
            if rings(replace(bare, environment=wall / hands * along_normal)):
                return quiet
            quiet = float(wall)
        return np.inf

    def largest_surface_stiffness(self, gains: Gains) -> float:
        """Returns the smallest stiffness at which a wall rings [N/m], see `largest_stiffness`."""
        loop, hands = self.with_gains(gains), self.encounter.hands
        return hands * largest_stiffness(loop, self.encounter.normal)


def _scaled(gain: Array, factor: float) -> Array:
    """Returns a gain (6×6) with its translational part scaled."""
    scaled = gain.copy()
    scaled[TRANSLATION, TRANSLATION] *= factor
    return scaled
