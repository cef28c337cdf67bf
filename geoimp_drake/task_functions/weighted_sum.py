"""Several task functions at once."""

from collections.abc import Sequence

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.task_functions.task_function import Instant, TaskFunction, TaskValue

__all__ = ["WeightedSum"]


class WeightedSum:
    """w = Σ c_k w_k; a negative weight makes a term descend while others climb.

    Args:
        terms: weight and task function of each.

    Raises:
        ConfigurationError: there are no terms, or a weight is not finite.
    """

    def __init__(self, terms: Sequence[tuple[float, TaskFunction]]):
        if not terms:
            raise ConfigurationError("A weighted sum has no terms; give at least one.")
        for k, (weight, _) in enumerate(terms):
            if not np.isfinite(weight):
                raise ConfigurationError(f"Weight {k} of the sum is {weight}; it must be finite.")
        self._terms = tuple(terms)

    def evaluate(self, instant: Instant) -> TaskValue:
        """Returns w and its derivatives."""
        terms = [(weight, task.evaluate(instant)) for weight, task in self._terms]
        return TaskValue(
            sum(weight * term.value for weight, term in terms),
            sum(weight * term.value_rate for weight, term in terms),
            np.add.reduce([weight * term.gradient for weight, term in terms]),
            np.add.reduce([weight * term.gradient_rate for weight, term in terms]),
        )
