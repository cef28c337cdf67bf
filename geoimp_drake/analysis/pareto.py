"""Pareto fronts: candidates that no other one beats in every objective."""

from collections.abc import Iterator

import numpy as np

from geoimp_drake.analysis.tuning import Candidate, Objective, Tuning, best
from geoimp_drake.typing import Array

__all__ = ["balance", "explored", "front_of"]

# Searches between the ends of a front.
_BETWEEN = 5
# Weight of the objectives that do not belong to a mixture.
_SLIGHT = 1e-3


def explored(tuning: Tuning, evaluations: int) -> list[Candidate]:
    """Returns all candidates tried for each objective alone, and for mixtures of neighbours.

    The searches for single objectives give a best and a worst value of each objective. A mixture is
    the largest of the weighted shares of the way from best to worst.

    Args:
        tuning: with one objective or more.
        evaluations: of each search.
    """
    given = tuning.on_model({name: tuning.model.given[name] for name in tuning.bounds}).values
    alone = [_single(k, value) for k, value in enumerate(given)]
    tried = [c for objective in alone for c in tuning.search(objective, evaluations)]
    ends = np.array([best(tried, objective).values for objective in alone])
    for weights in _weights(len(alone)):
        tried += tuning.search(_mixture(ends, weights), evaluations)
    return tried


def front_of(tried: list[Candidate]) -> list[Candidate]:
    """Returns candidates that keep the constraints and are not beaten, by the first objective."""
    front: list[Candidate] = []
    for candidate in sorted((c for c in tried if not c.broken), key=lambda c: c.values):
        if not any(np.all(np.less_equal(other.values, candidate.values)) for other in front):
            front.append(candidate)
    return front


def balance(front: list[Candidate]) -> Objective:
    """Returns the largest distance of values from the best of each objective on a front.

    With one objective, that is a share of the best.
    """
    ends = np.array([candidate.values for candidate in front])
    if ends.shape[1] == 1:
        return _single(0, float(ends.min()))
    return _mixture(ends, np.ones(ends.shape[1]))


def _single(k: int, given: float) -> Objective:
    scale = given if np.isfinite(given) else 1.0
    return lambda values: values[k] / scale


def _mixture(ends: Array, weights: Array) -> Objective:
    """Returns the largest weighted share of the way from the best to the worst of some values."""
    ideal, span = ends.min(axis=0), np.ptp(ends, axis=0)
    scale = weights / np.where(np.isfinite(span) & (span > 0.0), span, 1.0)
    return lambda values: float(np.max(scale * (np.array(values) - ideal)))


def _weights(count: int) -> Iterator[Array]:
    for k in range(count - 1):
        for share in np.linspace(0.0, 1.0, _BETWEEN + 2)[1:-1]:
            weights = np.full(count, _SLIGHT)
            weights[k : k + 2] = 1.0 - share, share
            yield weights
