"""One sample of a sweep: an experiment run without files, reduced to the figures of a row."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from geoimp_drake.simulation.claims import Claim
from geoimp_drake.simulation.run import simulate
from geoimp_drake.typing import Array

__all__ = ["Sample", "run_sample"]

Figures = dict[str, float | bool | None]


@dataclass(frozen=True)
class Sample:
    """What a process needs in order to run one sample.

    Attributes:
        experiment: from the catalogue.
        scenario: data of the sweep's scenario.
        overrides: the sample's own settings.
    """

    experiment: Any
    scenario: dict[str, Any]
    overrides: tuple[str, ...]


def run_sample(sample: Sample) -> dict[str, Any]:
    """Returns `success`, `peak_force`, `peak_moment`, the run's `figures` and its `failure`.

    An experiment may have `sweep_figures(log, scenario)`, a dictionary of numbers and truth values;
    they are figures too, and `success` among them is the sample's. Otherwise a sample succeeds if
    each of the experiment's claims holds. A run that ends early never succeeds.

    Raises:
        GeoimpError: the scenario cannot be used.
        RuntimeError: the simulation cannot even start.
        ValueError: likewise.
    """
    experiment = sample.experiment
    scenario = experiment.scenario((sample.scenario,), sample.overrides)
    setup = experiment.build(scenario)
    outcome = simulate(setup.diagram, scenario.simulator, scenario.duration, events=setup.events)
    if outcome.failure is not None and outcome.time == 0.0:
        raise outcome.failure
    log = setup.recorder.collect(outcome.context)
    claims = experiment.claims(log, scenario)
    figures = _own_figures(experiment, log, scenario)
    success = figures.pop("success", all(claim.holds is True for claim in claims))
    return {
        "success": bool(success) and outcome.failure is None,
        "peak_force": _peak(log, slice(3, 6)),
        "peak_moment": _peak(log, slice(0, 3)),
        "figures": {**figures, **_figures_of(claims)},
        "failure": None if outcome.failure is None else " ".join(str(outcome.failure).split()),
    }


def _own_figures(experiment: Any, log: dict[str, Array], scenario: Any) -> Figures:
    if experiment.sweep_figures is None:
        return {}
    measured = experiment.sweep_figures(log, scenario)
    return {name: _plain(value) for name, value in measured.items()}


def _plain(value: Any) -> float | bool | None:
    """Returns a number or truth value, of NumPy perhaps, as Python's own."""
    if value is None or isinstance(value, bool | np.bool_):
        return None if value is None else bool(value)
    return float(value)


def _figures_of(claims: list[Claim]) -> Figures:
    """Returns each claim's figure and whether it holds, by column."""
    figures: Figures = {}
    for claim in claims:
        name = f"{claim.claim} [{claim.unit}]" if claim.unit else claim.claim
        figures[name] = claim.figure
        figures[f"holds: {claim.claim}"] = claim.holds
    return figures


def _peak(log: dict[str, Array], part: slice) -> float:
    """Returns the largest norm of a part of any arm's true wrench."""
    wrenches = [log[key][:, part] for key in log if key.endswith("/wrench_true")]
    return float(max((np.linalg.norm(w, axis=1).max(initial=0.0) for w in wrenches), default=0.0))
