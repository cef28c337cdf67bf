"""Peg in hole at scale: samples end early, are counted by hand, and none is run twice."""

import csv

import pytest

from geoimp_drake.campaigns.sweep_plan import SweepPlan
from geoimp_drake.diagrams.experiments import peg_at_scale
from geoimp_drake.diagrams.experiments.peg_at_scale import (
    PLAN,
    PegAtScaleSection,
    hands_of,
    run_peg_at_scale,
)
from geoimp_drake.errors import ConfigurationError

UNREACHABLE = "tcp://127.0.0.1:1"  # whatever gets as far as that has something to run


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """A folder with one draw, given to two of the hands."""
    folder = tmp_path_factory.mktemp("peg") / "peg_at_scale"
    run_peg_at_scale(folder, samples=2)
    return folder


def test_samples_end_when_the_peg_is_in_and_leave_tables_and_maps(out):
    result = run_peg_at_scale(out, samples=2, scheduler=UNREACHABLE)  # all is there already
    assert result.failures == {}
    assert [hand.hand for hand in result.hands] == ["chapter's gains", "tuned gains"]
    assert all(row["success"] for row in result.rows)
    assert all(0.045 <= row["final_depth"] < 0.046 for row in result.rows)
    assert result.rows[0]["grasp.offset.0"] == result.rows[1]["grasp.offset.0"]
    assert result.rows[0]["peak_force"] > result.rows[1]["peak_force"]
    names = {path.name for path in out.iterdir()}
    assert names == set(PegAtScaleSection().files)
    with (out / "hands.csv").open(encoding="utf-8") as file:
        assert [row["success"] for row in csv.DictReader(file)] == ["1.0", "1.0"]
    assert result.claims[0].holds
    (table,) = PegAtScaleSection(samples=2).run(out, 1, ()).tables
    assert [row[:3] for row in table.rows] == [
        ("chapter's gains", "1", "1"),
        ("tuned gains", "1", "1"),
    ]


def test_more_samples_are_run_where_the_scheduler_has_its_workers(out, monkeypatch):
    monkeypatch.setattr("geoimp_drake.campaigns.many_runs._CONNECT_TIMEOUT", 0.5)
    with pytest.raises(ConfigurationError, match=r"scheduler .* does not answer"):
        run_peg_at_scale(out, samples=3, scheduler=UNREACHABLE)


def test_a_section_runs_all_of_the_plan_or_a_tenth(monkeypatch, tmp_path):
    asked = []

    def run(out, **options):
        asked.append(options)
        return peg_at_scale.ScaleResult([], [], [], {}, [])

    monkeypatch.setattr(peg_at_scale, "run_peg_at_scale", run)
    for section in (PegAtScaleSection(), PegAtScaleSection(quick=True, scheduler="there")):
        section.run(tmp_path, 2, ("seed=1",))
    assert [options["samples"] for options in asked] == [None, 1000]
    assert [options["scheduler"] for options in asked] == [None, "there"]
    assert asked[0]["overrides"] == ("seed=1",)


def test_the_plan_gives_ten_thousand_samples_to_five_hands_over_the_whole_range():
    plan = SweepPlan.read(PLAN)
    assert (plan.samples, len(plan.variants)) == (10_000, 5)
    drawn = [plan.draw(index).parameters for index in range(0, plan.samples, 5)]
    speeds = [3.0 * draw["program.constants.spd"] for draw in drawn]  # [mm/s]
    assert (min(speeds), max(speeds)) == pytest.approx((5.0, 30.0), abs=0.05)
    holes = [draw["peg_hole.hole_diameter"] for draw in drawn]
    assert (min(holes), max(holes)) == pytest.approx((0.0176, 0.0188), abs=2e-6)


def row(hand: str, ended: str, force: float) -> dict[str, object]:
    names = {"success": ("success", "seated"), "hard": ("seated",), "jammed": ("jammed",)}
    flags = {key: key in names.get(ended, ()) for key in ("success", "seated", "jammed")}
    return {"variant": hand, "peak_force": force, **flags}


def test_hands_are_counted_by_how_their_samples_ended():
    soft = [row("soft", ended, force) for ended, force in (("success", 10.0), ("jammed", 20.0))]
    stiff = [
        row("stiff", ended, force)
        for ended, force in (("hard", 60.0), ("missed", 131.0), ("missed", 130.0), ("success", 9.0))
    ]
    one, other = hands_of([*soft, *stiff])
    assert (one.samples, one.success, one.jammed, one.missed) == (2, 0.5, 0.5, 0.0)
    assert (other.success, other.seated, other.missed, other.stopped) == (0.25, 0.5, 0.5, 0.5)
    assert other.median_force == 95.0
    # Wilson's interval of 1 of 4, as in tables.
    assert (other.low, other.high) == pytest.approx((0.0456, 0.6994), abs=5e-4)
