"""What an arm does at its limits, with its own wrist sensor and tool."""

from dataclasses import replace

import numpy as np
import pytest
from library_tree import ROOT
from runs import assert_all_hold, claims_of, run

from geoimp_drake.campaigns.sweep_plan import SweepPlan
from geoimp_drake.campaigns.sweep_sample import Sample, run_sample
from geoimp_drake.compilation.compiled import is_available
from geoimp_drake.diagrams.experiments import limits, reproduction
from geoimp_drake.diagrams.experiments.at_limits import measured
from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS
from geoimp_drake.scenario.loading import plain_data, read_yaml
from geoimp_drake.simulation.claims import FAILS, NOT_REACHED, REPORTED

pytestmark = pytest.mark.skipif(not is_available(), reason="numba is not installed")

(STUDY,) = (study for study in reproduction.studies() if study.name == "limits")
VARIANTS = {variant.name: variant.settings for variant in STUDY.variants}
# The others are run by `geoimp reproduce` alone; tests/controllers/test_limits.py has all of them
# with an ideal sensor at the flange.
RUN = ("limits-elbow", "limits-wrist-start", "limits-wrist-passage", "limits-push")
COMPARED = ("limits-wrist-passage", "none-wrist-passage", "limits-push", "none-push")
STUDIES = ROOT / "docs" / "validation" / "studies"


@pytest.mark.parametrize("name", RUN)
def test_at_its_limits_an_arm_keeps_what_is_claimed(name: str) -> None:
    assert_all_hold(claims_of("limits", *VARIANTS[name]))


def test_every_case_is_run_with_limits_and_all_but_a_singular_start_without() -> None:
    cases = {kind: set() for kind in ("limits", "none")}
    for name in VARIANTS:
        kind, _, case = name.partition("-")
        cases[kind].add(case)
    assert len(cases["limits"]) == 8
    assert cases["limits"] - cases["none"] == {"wrist-start"}


def test_without_limits_the_arm_leaves_C_with_torques_that_no_motor_has() -> None:
    runs = {name: run("limits", *VARIANTS[name]) for name in COMPARED}
    compared = {name: (dict(log), scenario) for name, (log, scenario, _) in runs.items()}
    assert_all_hold({claim.claim: claim for claim in limits.claims_across(compared)})
    alone = claims_of("limits", *VARIANTS["none-push"])
    assert {claim.verdict for claim in alone.values()} == {REPORTED}
    figure = limits.figure_across(compared)
    assert [axes.get_xscale() for axes in figure.axes] == ["log"] * 3
    for axes in figure.axes:
        kept, free, _ = axes.lines
        assert (np.array(kept.get_xdata()) < np.array(free.get_xdata())).all()


def test_where_no_limit_acts_E_comes_back_with_the_law_alone() -> None:
    log, scenario, _ = run("limits", "external.force=[60, 0, 0]")
    values = measured(dict(log), scenario)
    assert not log["six/limited"].any()
    assert abs(values["back"]) <= 2e-3
    assert values["free"] == values["bound"] == 0.0


def test_what_is_off_the_law_is_found() -> None:
    """A slack that another mass than the impedance's had weighed has parts where E is free."""
    log, scenario, _ = run("limits", *VARIANTS["limits-wrist-passage"])
    rotation = replace(scenario.impedance.rotation, mass=np.array(4.0))
    other = replace(scenario, impedance=replace(scenario.impedance, rotation=rotation))
    assert measured(dict(log), other)["free"] > 3.0


def test_a_run_that_is_too_short_has_no_way_back() -> None:
    claims = claims_of("limits", "duration=0.05")
    assert {claim.verdict for claim in claims.values()} >= {NOT_REACHED}
    assert FAILS not in {claim.verdict for claim in claims.values()}
    log, scenario, _ = run("limits", "duration=0.05")
    both = {"limits-elbow": (dict(log), scenario), "none-elbow": (dict(log), scenario)}
    assert {claim.verdict for claim in limits.claims_across(both)} == {NOT_REACHED}
    limits.figure_across(both).draw_without_rendering()


def test_some_of_the_thousand_random_demands_are_met() -> None:
    plan = SweepPlan.read(STUDIES / "limits_plan.yaml")
    experiment = EXPERIMENTS["limits"]
    scenario = plain_data(experiment.scenario((read_yaml(STUDIES / "limits.yaml"),)))
    results = [
        run_sample(Sample(experiment, scenario, plan.draw(k).overrides()))
        for k in range(0, 1000, 250)
    ]
    assert [result["failure"] for result in results] == [None] * 4
    assert all(result["success"] for result in results)
