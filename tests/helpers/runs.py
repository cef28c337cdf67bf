"""Runs of experiments for the tests: built and simulated once a session, in memory."""

from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np

from geoimp_drake.campaigns.fastest_form import fastest_form
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.simulation.claims import Claim
from geoimp_drake.simulation.run import simulate


@cache
def run(name: str, *overrides: str) -> tuple[Any, Any, Exception | None]:
    """Returns log, scenario and failure of an experiment with overrides.

    The form is the fastest one unless overridden. Tests of the controllers show that the other form
    gives the same to the bit.
    """
    experiment = get_experiment(name)
    scenario = experiment.scenario((fastest_form(),), overrides)
    setup = experiment.build(scenario)
    outcome = simulate(setup.diagram, scenario.simulator, scenario.duration, events=setup.events)
    log = setup.recorder.collect(outcome.context)
    for value in log.values():
        value.setflags(write=False)
    return MappingProxyType(log), scenario, outcome.failure


def family(name: str) -> str:
    """Returns the override that chooses an orientation family."""
    return f"impedance.orientation={name}"


def claims_of(name: str, *overrides: str) -> dict[str, Claim]:
    """Returns the claims of a run by their words."""
    log, scenario, failure = run(name, *overrides)
    assert failure is None
    return {claim.claim: claim for claim in get_experiment(name).claims(dict(log), scenario)}


def assert_all_hold(claims: dict[str, Claim]) -> None:
    """Fails unless there are claims, and every one was judged and holds."""
    assert claims
    assert {name: claim.holds for name, claim in claims.items()} == dict.fromkeys(claims, True)


def norm(log: Any, key: str, part: slice) -> np.ndarray:
    """Returns the norm of a part of a logged vector over time."""
    return np.linalg.norm(log[key][:, part], axis=1)
