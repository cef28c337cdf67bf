"""CMA-ES in the unit cube, the same to the bit for the same seed."""

from collections.abc import Callable, Sequence

import numpy as np

from geoimp_drake.extras import needs_extra
from geoimp_drake.typing import Array

__all__ = ["check_cma", "minimize"]


def check_cma(label: str) -> None:
    """Raises ConfigurationError if the extra that minimizes is missing."""
    with needs_extra("tune", label):
        import cma  # noqa: F401  (an extra: imported only where it is used)


def minimize(
    evaluate: Callable[[Sequence[Array]], list[float]],
    start: Array,
    *,
    seed: int,
    evaluations: int,
    sigma: float,
    population: int | None = None,
) -> None:
    """Lets CMA-ES search for the minimum of a function; `evaluate` sees all that it tries.

    Args:
        evaluate: returns the values at some points, each (n,), in the unit cube.
        start: point to begin with (n,).
        seed: of the draws.
        evaluations: number of points, rounded up to a whole generation.
        sigma: standard deviation of the first draws.
        population: points of a generation; by default cma's own choice.
    """
    import cma  # an extra: imported only where it is used

    generator = np.random.default_rng(seed)
    # cma does not search along a single axis; a second one is added, which changes nothing.
    places = np.resize(np.append(start, 0.5), max(2, len(start)))
    options = {
        "bounds": [0.0, 1.0],
        "randn": lambda *shape: generator.standard_normal(shape),
        "seed": np.nan,  # the draws are ours, and NumPy's are left alone
        "maxfevals": evaluations - 1,  # cma goes on until there are more
        "tolx": 1e-4,
        "verbose": -9,
        **({} if population is None else {"popsize": population}),
    }
    search = cma.CMAEvolutionStrategy(places, sigma, options)
    while not search.stop():
        asked = search.ask()
        search.tell(asked, evaluate([place[: len(start)] for place in asked]))
