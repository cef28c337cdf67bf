"""One sample of a sweep: an experiment run without files, reduced to the values of a row."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from geoimp_drake.errors import one_line
from geoimp_drake.simulation.claims import HOLDS, REPORTED, Claim
from geoimp_drake.simulation.experiment import simulated
from geoimp_drake.typing import Array

__all__ = ["SAMPLE_FIELDS", "Sample", "run_sample"]

# Types of the results of `run_sample`.
SAMPLE_FIELDS = {
    "success": bool,
    "peak_force": float,
    "peak_moment": float,
    "values": dict,
    "failure": str | None,
}

Values = dict[str, float | bool | None]


@dataclass(frozen=True)
class Sample:
    """All that a process needs to run one sample.

    Attributes:
        experiment: from the catalogue.
        scenario: data of the sweep's scenario.
        overrides: the sample's own settings.
    """

    experiment: Any
    scenario: dict[str, Any]
    overrides: tuple[str, ...]


def run_sample(sample: Sample) -> dict[str, Any]:
    """Returns `success`, `peak_force`, `peak_moment`, the run's `values` and its `failure`.

    An experiment may have `sweep_values(log, scenario)`, a dictionary of numbers and truth values
    that become part of `values`; a `success` among them is the sample's. Without one, a sample
    succeeds if each of the experiment's claims holds. A run that ends early never succeeds.

    Raises:
        GeoimpError: the scenario cannot be used, or the simulation cannot even start.
    """
    experiment = sample.experiment
    scenario = experiment.scenario((sample.scenario,), sample.overrides)
    log, failure = simulated(experiment.build(scenario), scenario)
    claims = experiment.claims(log, scenario)
    values = _own_values(experiment, log, scenario)
    success = values.pop("success", all(claim.verdict in (HOLDS, REPORTED) for claim in claims))
    return {
        "success": bool(success) and failure is None,
        "peak_force": _peak(log, slice(3, 6)),
        "peak_moment": _peak(log, slice(0, 3)),
        "values": {**values, **_values_of(claims)},
        "failure": None if failure is None else one_line(failure),
    }


def _own_values(experiment: Any, log: dict[str, Array], scenario: Any) -> Values:
    if experiment.sweep_values is None:
        return {}
    measured = experiment.sweep_values(log, scenario)
    return {name: _plain(value) for name, value in measured.items()}


def _plain(value: Any) -> float | bool | None:
    """Returns a number or truth value, maybe NumPy's, as one of Python's own."""
    if value is None or isinstance(value, bool | np.bool_):
        return None if value is None else bool(value)
    return float(value)


def _values_of(claims: list[Claim]) -> Values:
    """Returns each claim's value and whether it holds, by column."""
    values: Values = {}
    for claim in claims:
        name = f"{claim.claim} [{claim.unit}]" if claim.unit else claim.claim
        values[name] = claim.value
        if claim.bound is not None:
            values[f"holds: {claim.claim}"] = claim.holds
    return values


def _peak(log: dict[str, Array], part: slice) -> float:
    """Returns the largest norm of a part of any arm's true wrench."""
    wrenches = [log[key][:, part] for key in log if key.endswith("/wrench_true")]
    return float(max((np.linalg.norm(w, axis=1).max(initial=0.0) for w in wrenches), default=0.0))
