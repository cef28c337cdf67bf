"""Gains that make a contact best within bounds and constraints, as the law's rollout has it."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from geoimp_drake.analysis.contact_model import ROBUSTNESS, ContactModel
from geoimp_drake.analysis.encounter import METRICS
from geoimp_drake.analysis.evolution import minimize
from geoimp_drake.typing import Array

__all__ = ["UNITS", "Candidate", "Constraint", "Objective", "Tuning", "best"]

# Of all that a constraint can be put on.
UNITS = {**METRICS, ROBUSTNESS: "N/m"}
# Above every objective: where constraints are broken, by how much is what counts.
_BROKEN = 1e9
# How much a bound counts as broken by a value that is infinite.
_HOPELESS = 100.0
# Of an objective, for which a gain is moved over its whole range.
_STAY = 0.02
# Of the first draws, over the logarithmic range of a gain.
_SIGMA = 0.25

# Of the values of the objectives, a number of about one that is to be small.
Objective = Callable[[tuple[float, ...]], float]


@dataclass(frozen=True)
class Constraint:
    """A bound on a metric, an upper or a lower one."""

    name: str
    bound: float
    is_upper: bool = True

    def broken(self, value: float) -> float:
        """Returns by how much of the bound it is broken, zero if it is kept."""
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
        broken: by how much of their bounds constraints are broken, in all.
        moved: squared distance from the given gains, in logarithmic ranges.
    """

    gains: dict[str, float]
    values: tuple[float, ...]
    broken: float
    moved: float

    def fitness(self, objective: Objective) -> float:
        """Returns that of the objective, or beyond all of these what counts what is broken.

        Of gains that are nearly as good, those near the given ones are better.
        """
        if self.broken:
            return _BROKEN * (1.0 + self.broken)
        return min(objective(self.values) + _STAY * self.moved, _BROKEN)


def best(tried: Iterable[Candidate], objective: Objective) -> Candidate:
    """Returns the candidate of the least fitness."""
    return min(tried, key=lambda candidate: candidate.fitness(objective))


@dataclass(frozen=True)
class Tuning:
    """What is to be made best.

    Attributes:
        model: that says what gains do.
        walls: stiffnesses of walls, the worst of which counts [N/m].
        objectives: of METRICS.
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
        """Returns all that was tried on the model to make an objective small."""
        tried: list[Candidate] = []

        def evaluate(places: Sequence[Array]) -> list[float]:
            new = [self.on_model(self.gains_at(place)) for place in places]
            tried.extend(new)
            return [candidate.fitness(objective) for candidate in new]

        start = self.place_of(self.model.given)
        minimize(evaluate, start, seed=self.seed, evaluations=evaluations, sigma=_SIGMA)
        return tried

    def on_model(self, gains: Mapping[str, float]) -> Candidate:
        """Returns what the model says of gains."""
        return self.judged(gains, [self.model.metrics(gains, wall) for wall in self.walls])

    def judged(self, gains: Mapping[str, float], told: Sequence[Mapping[str, float]]) -> Candidate:
        """Returns a candidate of gains with metrics on some walls, or of a run."""
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
        """Returns the gains at a place in the unit cube (n), by the logarithm of each range."""
        return {
            name: float(low * (high / low) ** share)
            for (name, (low, high)), share in zip(self.bounds.items(), place, strict=True)
        }

    def place_of(self, gains: Mapping[str, float]) -> Array:
        """Returns the place of gains, of the nearest within the bounds (n)."""
        places = [
            np.log(gains[name] / low) / np.log(high / low)
            for name, (low, high) in self.bounds.items()
        ]
        return np.clip(places, 0.0, 1.0)
