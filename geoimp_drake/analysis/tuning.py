"""Gains that make a contact best within bounds and constraints, by rollouts of the law."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from geoimp_drake.analysis.contact_model import ROBUSTNESS, ContactModel
from geoimp_drake.analysis.encounter import METRICS
from geoimp_drake.analysis.evolution import minimize
from geoimp_drake.typing import Array

__all__ = ["UNITS", "Candidate", "Constraint", "Objective", "Tuning", "best"]

# Units of all metrics that a constraint can bound.
UNITS = {**METRICS, ROBUSTNESS: "N/m"}
# Larger than every objective: if constraints are broken, only the amount counts.
_BROKEN = 1e9
# An infinite value counts as breaking a bound by this factor.
_HOPELESS = 100.0
# The share of an objective that moving a gain over its whole range costs.
_STAY = 0.02
# Standard deviation of the first draws, as a share of a gain's logarithmic range.
_SIGMA = 0.25

# From the values of the objectives to a number of about one, to be minimized.
Objective = Callable[[tuple[float, ...]], float]


@dataclass(frozen=True)
class Constraint:
    """A bound on a metric, an upper or a lower one."""

    name: str
    bound: float
    is_upper: bool = True

    def broken(self, value: float) -> float:
        """Returns by which share of the bound it is broken; zero if it is kept."""
        excess = value - self.bound if self.is_upper else self.bound - value
        return float(np.clip(excess / abs(self.bound), 0.0, _HOPELESS))

    def __str__(self) -> str:
        """Returns it as it is written, with the unit."""
        return f"{self.name} {'<' if self.is_upper else '>'} {self.bound:.4g} {UNITS[self.name]}"


@dataclass(frozen=True)
class Candidate:
    """Gains that were tried.

    Attributes:
        gains: along the normal, by letter.
        values: of the objectives, each the worst over the walls.
        broken: the sum of the shares of their bounds by which constraints are broken.
        moved: squared distance from the given gains, in logarithmic ranges.
    """

    gains: dict[str, float]
    values: tuple[float, ...]
    broken: float
    moved: float

    def fitness(self, objective: Objective) -> float:
        """Returns the objective's value, or a larger number if constraints are broken.

        Of nearly equal gains, those nearer to the given ones are better.
        """
        if self.broken:
            return _BROKEN * (1.0 + self.broken)
        return min(objective(self.values) + _STAY * self.moved, _BROKEN)


def best(tried: Iterable[Candidate], objective: Objective) -> Candidate:
    """Returns the candidate of the least fitness."""
    return min(tried, key=lambda candidate: candidate.fitness(objective))


@dataclass(frozen=True)
class Tuning:
    """A problem of tuning.

    Attributes:
        model: predicts the effect of gains.
        walls: stiffnesses of walls, the worst of which counts [N/m].
        objectives: names of METRICS.
        constraints: on these and on ROBUSTNESS.
        bounds: of each gain that varies, by letter.
        seed: of the search.
    """

    model: ContactModel
    walls: tuple[float, ...]
    objectives: tuple[str, ...]
    constraints: tuple[Constraint, ...]
    bounds: Mapping[str, tuple[float, float]]
    seed: int

    def search(self, objective: Objective, evaluations: int) -> list[Candidate]:
        """Returns all candidates that were tried on the model to minimize an objective."""
        tried: list[Candidate] = []

        def evaluate(places: Sequence[Array]) -> list[float]:
            new = [self.on_model(self.gains_at(place)) for place in places]
            tried.extend(new)
            return [candidate.fitness(objective) for candidate in new]

        start = self.place_of(self.model.given)
        minimize(evaluate, start, seed=self.seed, evaluations=evaluations, sigma=_SIGMA)
        return tried

    def on_model(self, gains: Mapping[str, float]) -> Candidate:
        """Returns the candidate of gains, as the model predicts it."""
        return self.judged(gains, [self.model.metrics(gains, wall) for wall in self.walls])

    def judged(self, gains: Mapping[str, float], told: Sequence[Mapping[str, float]]) -> Candidate:
        """Returns a candidate of gains, from metrics on some walls or of a run."""
        values = tuple(max(row[name] for row in told) for name in self.objectives)
        broken = sum(self._broken(constraint, gains, told) for constraint in self.constraints)
        away = self.place_of(gains) - self.place_of(self.model.given)
        return Candidate(dict(gains), values, broken, float(away @ away))

    def _broken(
        self,
        constraint: Constraint,
        gains: Mapping[str, float],
        told: Sequence[Mapping[str, float]],
    ) -> float:
        if constraint.name == ROBUSTNESS:
            return constraint.broken(self.model.quiet_up_to(gains, constraint.bound))
        return max(constraint.broken(row[constraint.name]) for row in told)

    def gains_at(self, place: Array) -> dict[str, float]:
        """Returns the gains at a point of the unit cube (n), on logarithmic scales."""
        return {
            name: float(low * (high / low) ** share)
            for (name, (low, high)), share in zip(self.bounds.items(), place, strict=True)
        }

    def place_of(self, gains: Mapping[str, float]) -> Array:
        """Returns the point of gains (n), of the nearest ones within the bounds."""
        places = [
            np.log(gains[name] / low) / np.log(high / low)
            for name, (low, high) in self.bounds.items()
        ]
        return np.clip(places, 0.0, 1.0)
