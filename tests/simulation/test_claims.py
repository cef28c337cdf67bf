"""Claims: a number without a bound is reported, and is neither true nor false."""

import json
import types

import pytest

from geoimp_drake.campaigns.reproduction import VariantResult
from geoimp_drake.campaigns.study import Variant
from geoimp_drake.campaigns.sweep_sample import Sample, run_sample
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.scenario.loading import plain_data
from geoimp_drake.simulation.claims import (
    FAILS,
    HOLDS,
    NOT_REACHED,
    REPORTED,
    Claim,
    at_least,
    at_most,
    format_claims,
)

INFINITY = float("inf")


@pytest.mark.parametrize(
    ("claim", "verdict"),
    [
        (at_most("c", 1.0, 2.0), HOLDS),
        (at_most("c", 3.0, 2.0), FAILS),
        (at_most("c", float("nan"), 2.0), FAILS),
        (at_least("c", 1.0, 2.0), FAILS),
        (at_least("c", 3.0, 2.0), HOLDS),
        (at_most("c", None, 2.0), NOT_REACHED),
        (at_most("c", None, INFINITY), NOT_REACHED),
        (at_most("c", 3.0, INFINITY), REPORTED),
        (at_least("c", 3.0, -INFINITY), REPORTED),
    ],
)
def test_a_verdict_needs_a_number_and_a_bound(claim, verdict):
    assert claim.verdict == verdict
    assert (claim.holds is None) == (verdict in (NOT_REACHED, REPORTED))
    assert repr(Claim(**json.loads(json.dumps(claim.as_dict())))) == repr(claim)


def test_a_table_has_the_number_without_a_verdict():
    table = format_claims([at_most("largest force", 3.0, INFINITY, "N")])
    assert table.splitlines()[1].split() == ["largest", "force", "3", "N", "–", "reported"]
    assert "inf" not in table


def test_a_reproduction_counts_it_apart(tmp_path):
    variant = Variant("v", "v", (), {}, {"largest": "cannot be broken on purpose"})
    claims = (at_most("largest", 3.0, INFINITY), at_most("other", 1.0, 2.0))
    judged = VariantResult(variant, tmp_path, (), claims, None).judged()
    assert [one.verdict for one in judged] == [REPORTED, HOLDS]


@pytest.mark.parametrize(("other", "success"), [(1.0, True), (3.0, False)])
def test_a_sample_succeeds_by_what_is_bounded(other, success):
    experiment = get_experiment("plexiglas")
    data = plain_data(experiment.scenario((), ("duration=0.01",)))
    claims = [at_most("largest", 3.0, INFINITY), at_most("other", other, 2.0)]
    own = types.SimpleNamespace(
        scenario=experiment.scenario,
        build=experiment.build,
        claims=lambda *_: claims,
        sweep_values=None,
    )
    row = run_sample(Sample(own, data, ()))
    assert row["success"] is success
    assert row["values"] == {"largest": 3.0, "other": other, "holds: other": success}
