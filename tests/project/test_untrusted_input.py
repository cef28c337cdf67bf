"""Scenarios, journals, logs and programs come from anybody: nothing in them is run, and it shows.

What a name holds stays text in pages, and nothing outside the folder that was named is written.
"""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from browser import visit

import geoimp_drake
from geoimp_drake import cli
from geoimp_drake.campaigns.journal import Journal
from geoimp_drake.campaigns.report import REPORT, write_report
from geoimp_drake.campaigns.reproduction import Reproduction, StudyResult, VariantResult
from geoimp_drake.campaigns.study import Study, Variant
from geoimp_drake.campaigns.table import Page
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.simulation.claims import Claim
from geoimp_drake.simulation.notebook import show_diagram

# Each of these would set a mark in a page that took it for more than text.
MARKUP = "</td></script><script>window.mark=1</script><img src=x onerror=window.mark=1>"


class Attack:
    """What runs a command when it is unpickled."""

    def __init__(self, command: str):
        self._command = command

    def __reduce__(self):
        return os.system, (self._command,)


@pytest.fixture
def mark(tmp_path):
    """A file that is there if anything has been executed."""
    yield tmp_path / "mark"
    assert not (tmp_path / "mark").exists()


def test_a_log_is_not_unpickled(tmp_path, mark):
    attack = np.array([Attack(f"touch {mark}")], dtype=object)
    np.savez(tmp_path / "log.npz", t=attack)
    with np.load(tmp_path / "log.npz", allow_pickle=True) as log:
        log["t"]
    assert mark.exists()  # so the attack is one
    mark.unlink()
    with pytest.raises(ConfigurationError, match="cannot be read"):
        geoimp_drake.load_log(tmp_path)


YAML_ATTACKS = ["!!python/object/apply:os.system ['touch {mark}']", "!!python/name:os.system"]


@pytest.mark.parametrize("attack", YAML_ATTACKS)
def test_yaml_makes_nothing_but_data(attack, tmp_path, mark, capsys):
    value = attack.format(mark=mark)
    scenario, plan = tmp_path / "scenario.yaml", tmp_path / "plan.yaml"
    scenario.write_text(f"log_period: {value}\n")
    plan.write_text(f"samples: {value}\n")
    for arguments in (
        ("run", "plexiglas", "--scenario", str(scenario)),
        ("run", "plexiglas", "--set", f"log_period={value}"),
        ("sweep", "plexiglas", "--plan", str(plan), "--out", str(tmp_path / "out")),
    ):
        assert cli.main(arguments) == 2
        assert "is not read; give plain values" in capsys.readouterr().err
    (tmp_path / "metrics.json").write_text(value)
    np.savez(tmp_path / "log.npz", t=np.zeros(1))
    assert geoimp_drake.load_log(tmp_path).attrs["metrics"] == value


def test_a_journal_is_only_data(tmp_path, mark):
    journal = tmp_path / "journal.jsonl"
    line = {"key": "k", "result": f"__import__('os').system('touch {mark}')"}
    record = {**line, "error": None, "wall_time": 1.0}
    journal.write_text(f'{{"plan": {{}}}}\n{json.dumps(record)}\n')
    assert Journal(journal, {}).read()["k"].result == line["result"]


PROGRAM_ATTACKS = [
    "MOVE LINEAR TO __import__('os').system('touch {mark}')",
    "CALL __import__('os').system('touch {mark}')",
    "SYS_CALL('touch {mark}')",
    "{{{{ ''.__class__.__mro__[1].__subclasses__() }}}}",
]


@pytest.mark.parametrize("attack", PROGRAM_ATTACKS)
def test_a_motion_program_runs_nothing_but_motions(attack, tmp_path, mark, capsys):
    program = tmp_path / "attack.pdl"
    program.write_text(f"PROGRAM attack\nBEGIN\n  {attack.format(mark=mark)}\nEND attack\n")
    setting = f"program.file={program}"
    assert cli.main(["run", "peg_in_hole", "--set", setting, "--out", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def names_of_everything(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}


def test_names_lead_nowhere_and_are_texts_in_a_replay(tmp_path, monkeypatch):
    """A replay has the names of models; a path or a markup in one is a text."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    short = ("--duration", "0.02", "--no-figures", "--html", "--out", "out")
    names = [f"segments.0.name='../../{MARKUP}'", f"surface.properties.name='../{MARKUP}'"]
    settings = [part for name in names for part in ("--set", name)]
    assert cli.main(["run", "plexiglas", *settings, *short]) == 0
    files = {"log.npz", "scenario.yaml", "metrics.json", "replay.html"}
    expected = {"here", "here/out", *(f"here/out/{file}" for file in files)}
    assert names_of_everything(tmp_path) == expected
    with visit(tmp_path / "here" / "out" / "replay.html") as visited:
        visited.page.wait_for_timeout(300)
        assert visited.page.evaluate("window.mark") is None
    assert visited.errors == []
    assert len(visited.requests) == 1


def test_names_and_errors_are_texts_in_the_report(tmp_path):
    claim = Claim(MARKUP, 1.0, MARKUP, MARKUP, False)
    variant = Variant("v", MARKUP, (), {}, {MARKUP: MARKUP})
    study = Study(
        get_experiment("plexiglas"), "plexiglas", (variant,), None, (), MARKUP, MARKUP, 1.0
    )
    result = VariantResult(variant, tmp_path, (), (claim,), MARKUP)
    results = Reproduction((StudyResult(study, (result,), (), ()),), None)
    write_report(results, tmp_path, Page("reproduce", "A report"))
    with visit(tmp_path / REPORT) as visited:
        assert visited.page.evaluate("window.mark") is None
        assert visited.page.inner_text("body").count(MARKUP) >= 6
    assert visited.errors == []
    assert len(visited.requests) == 1


def test_names_are_texts_in_a_block_diagram(tmp_path):
    from pydrake.systems.framework import DiagramBuilder
    from pydrake.systems.primitives import Adder, ConstantVectorSource

    builder = DiagramBuilder()
    source = builder.AddNamedSystem(MARKUP, ConstantVectorSource([1.0]))
    adder = builder.AddNamedSystem("sum", Adder(1, 1))
    builder.Connect(source.get_output_port(), adder.get_input_port())
    svg = show_diagram(builder.Build())._repr_svg_()
    page = tmp_path / "page.html"
    page.write_text(f"<!DOCTYPE html><link rel=icon href=data:,>{svg}", "utf-8")
    with visit(page) as visited:
        assert visited.page.evaluate("window.mark") is None
        assert MARKUP in visited.page.evaluate("document.body.textContent")
    assert len(visited.requests) == 1
