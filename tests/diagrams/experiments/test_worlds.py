"""Claims in other worlds: every run is named, and a cell says to what size a claim stands."""

import csv
import importlib.util
import json
from pathlib import Path

import pytest
from library_tree import ROOT

from geoimp_drake import cli
from geoimp_drake.diagrams.experiments import worlds, worlds_matrix
from geoimp_drake.scenario.loading import read_yaml

PLAN = {
    "experiments": ["consistency"],
    "errors": {"masses": {"+10 %": ["world.links.mass=1.1"], "+20 %": ["world.links.mass=1.2"]}},
    "mixes": {"mild": ["world.links.mass_spread=0.05"]},
    "seeds": 2,
}


def test_every_experiment_meets_every_error_of_the_plan():
    plan = read_yaml(Path(worlds.__file__).with_suffix(".yaml"))
    plan["seeds"] = 1
    runs = list(worlds.worlds(plan))
    sizes = sum(len(sizes) for sizes in plan["errors"].values())
    assert len(runs) == len({run.key for run in runs}) == 7 * (1 + sizes + 2)
    # Without an error the world is the model.
    nothing = [run.scenario["world"] for run in runs if run.error == "none"]
    assert all(world == nothing[0] for world in nothing)
    mild = [run for run in runs if run.error == "mild"]
    assert all(run.scenario["world"]["kinematics"]["position_spread"] == 2e-4 for run in mild)


@pytest.mark.parametrize(
    ("runs", "words", "share"),
    [
        ([("5 %", True), ("10 %", True)], "holds", 1.0),
        ([("5 %", True), ("10 %", False)], "to 5 %", 0.5),
        ([("5 %", False), ("10 %", True)], "fails", 0.0),
        ([("", True), ("", False), ("", None), ("", True)], "2 of 4", 0.5),
        ([("5 %", None)], "–", None),
    ],
)
def test_a_cell_says_to_what_size_a_claim_stands(runs, words, share):
    assert worlds_matrix._cell(runs) == worlds_matrix.Cell(words, share)


def test_a_plan_leaves_table_heat_map_and_claims_and_is_not_run_twice(tmp_path):
    for _ in range(2):
        short = ("duration=0.05",)
        result = worlds.run_worlds(tmp_path, jobs=1, overrides=short, plan=PLAN)
        assert result.failures == {}
        files = {"worlds.csv", "worlds.json", "worlds.png", "worlds.pdf"}
        assert {path.name for path in result.files} == files
    rows = list(csv.reader((tmp_path / "worlds.csv").read_text("utf-8").splitlines()))
    assert rows[0] == ["experiment", "claim", "none", "masses", "mild"]
    aligned = ["consistency", "largest misalignment δ at E", "holds", "holds", "2 of 2"]
    assert aligned in rows
    assert json.loads((tmp_path / "worlds.json").read_text("utf-8")) == []
    lines = (tmp_path / "journal.jsonl").read_text("utf-8").splitlines()
    assert len(lines) == 1 + 1 + 2 + 2


def test_the_command_line_refuses_what_one_run_alone_can_have(capsys, tmp_path):
    assert cli.main(["run", "worlds", "--html", "--out", str(tmp_path)]) == 2
    assert "leave out" in capsys.readouterr().err
    assert cli.main(["run", "plexiglas", "--jobs", "2", "--out", str(tmp_path)]) == 2
    assert "--jobs is for worlds" in capsys.readouterr().err


def test_four_times_the_gain_cuts_the_offset_to_a_quarter_far_from_the_predictors_limit():
    path = ROOT / "docs" / "validation" / "studies" / "design_against_error.py"
    spec = importlib.util.spec_from_file_location("design_against_error", path)
    study = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(study)
    heavier = study.ERRORS["links 10 % heavier"]
    once, four_times = study.off(1.0, heavier), study.off(4.0, heavier)
    assert once / four_times == pytest.approx(4.0, rel=0.02)
    limit = study.largest_factor()
    assert 400.0 < limit < 600.0
    page = (ROOT / "docs" / "validation" / "worlds.md").read_text("utf-8")
    assert f"| {once:.2g} mm | {four_times:.2g} mm |" in page
