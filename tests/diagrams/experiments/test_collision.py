"""An arm that runs into somebody keeps the limit with all measures, and not without them."""

import numpy as np
import pytest
from library_tree import ROOT
from runs import assert_all_hold, claims_of, run

from geoimp_drake.campaigns.sweep_plan import SweepPlan
from geoimp_drake.controllers.config import FORMS
from geoimp_drake.diagrams.experiments import collision, reproduction
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.scenario.loading import read_yaml
from geoimp_drake.simulation.claims import NOT_REACHED
from geoimp_drake.simulation.run import simulate

(STUDY,) = (study for study in reproduction.studies() if study.name == "collision")
VARIANTS = {variant.name: variant for variant in STUDY.variants}
CLAMPED = [name for name in VARIANTS if name.startswith("all-") and "free" not in name]
# What the claims across measures need of one case; the others are run by `geoimp reproduce` alone.
NEEDED = tuple(f"{kind}-hand-down" for kind in ("all", "leash", "cap", "reaction", "none"))
LIMIT = 150.0


@pytest.mark.parametrize("name", CLAMPED)
def test_every_clamped_body_is_hit_with_less_than_the_limit(name):
    settings = VARIANTS[name].settings
    assert_all_hold(claims_of("collision", *settings))
    log, scenario, _ = run("collision", *settings)
    values = collision.measured(dict(log), scenario)
    assert 10.0 < values["peak"] < 0.25 * LIMIT
    assert values["left"] < 1.0  # the hand goes back and stays there


def test_there_are_eight_clamped_cases():
    assert len(CLAMPED) == 8


def test_a_free_body_is_hit_with_less_than_the_limit():
    assert_all_hold(claims_of("collision", *VARIANTS["all-hand-free"].settings))


@pytest.mark.parametrize("sample", [0, 1, 3])
def test_random_collisions_keep_the_limit(sample):
    """The first of those of docs/validation/collision.md."""
    studies = ROOT / "docs" / "validation" / "studies"
    plan = SweepPlan.read(studies / "collision_plan.yaml")
    layers, experiment = (read_yaml(studies / "collision.yaml"),), get_experiment("collision")
    scenario = experiment.scenario(layers, plan.draw(sample).overrides())
    setup = experiment.build(scenario)
    outcome = simulate(setup.diagram, scenario.simulator, scenario.duration)
    values = collision.sweep_values(setup.recorder.collect(outcome.context), scenario)
    assert outcome.failure is None
    assert values["success"]
    assert 5.0 < values["peak"] < 0.25 * LIMIT


def test_each_measure_has_its_part():
    runs = {name: run("collision", *VARIANTS[name].settings) for name in NEEDED}
    compared = {name: (dict(log), scenario) for name, (log, scenario, _) in runs.items()}
    assert_all_hold({claim.claim: claim for claim in collision.claims_across(compared)})
    peak = {name: collision.measured(*compared[name])["peak"] for name in NEEDED}
    # The cap is needed: a reaction alone comes too late.
    assert peak["none-hand-down"] > 5 * LIMIT
    assert peak["reaction-hand-down"] > 2 * LIMIT
    assert peak["leash-hand-down"] < 1.02 * LIMIT
    figure = collision.figure_across(compared)
    (axes,) = figure.axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["hand, from above"]
    *marked, _ = axes.lines
    assert len({line.get_marker() for line in marked}) == len(marked) == len(NEEDED)
    drawn = {line.get_label(): line.get_xdata() for line in axes.lines}
    assert drawn["without"][0] == pytest.approx(peak["none-hand-down"])
    assert drawn["limit"][0] == LIMIT


def test_a_run_that_is_too_short_is_not_judged():
    short = claims_of("collision", "duration=0.02", "segments=[{duration: 0.5}]")
    assert {claim.verdict for claim in short.values()} <= {NOT_REACHED, "holds"}
    log, scenario, _ = run("collision", "duration=0.02", "segments=[{duration: 0.5}]")
    assert not np.any(log["body/force"])
    # Nobody was hit, so no limit was kept.
    assert not collision.sweep_values(dict(log), scenario)["success"]
    collision.figures(dict(log), scenario)["collision"].draw_without_rendering()


def test_both_forms_leave_the_same_log_of_a_collision():
    near = "duration=0.3", "body.point=[0.9, 0.0, 0.675]"
    blocks, compiled = (run("collision", *near, f"form={form}")[0] for form in FORMS)
    assert set(blocks) == set(compiled)
    assert blocks["body/force"].max() > 15.0  # it is noticed, and D rests from then on
    assert not blocks["six/motion_D"][-1, 7:].any()
    for name in blocks:
        np.testing.assert_allclose(compiled[name], blocks[name], atol=1e-9, err_msg=name)
