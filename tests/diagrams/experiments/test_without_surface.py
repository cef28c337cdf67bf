"""Without its surface an experiment has nothing to press on, and says so instead of failing."""

import dataclasses

import pytest
from runs import run

from geoimp_drake.diagrams.experiments.catalogue import get_experiment

SHORT = "duration=0.05"


@pytest.mark.parametrize("name", ["plexiglas", "singularity", "redundancy", "bar"])
def test_claims_on_contact_are_not_reached_without_a_surface(name):
    log, scenario, failure = run(name, SHORT, "surface=null")
    assert failure is None
    # As if the whole motion had been run.
    segments = [
        dataclasses.replace(segment, duration=1e-4 * segment.duration)
        for segment in scenario.segments
    ]
    ended = dataclasses.replace(scenario, segments=segments)
    claims = {claim.claim: claim for claim in get_experiment(name).claims(dict(log), ended)}
    not_reached = [claim for claim in claims.values() if claim.holds is None]
    assert len(not_reached) >= 3
    assert all(claim.value is None for claim in not_reached)
    assert get_experiment(name).figures(dict(log), ended)
