"""`geoimp bench`: what it reports. How fast anything is, no test judges."""

import json

import pytest

from geoimp_drake import cli
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.simulation import bench
from geoimp_drake.simulation.bench import Timing, format_timings, time_experiment

TIMING = Timing("single_free", loop=500.0, logged=800.0, bare=50.0, step=1e-3)


def test_ratio_and_real_time_factor_are_those_of_the_figures():
    assert TIMING.ratio == pytest.approx(10.0)
    assert TIMING.real_time_factor == pytest.approx(1.25)


def test_the_table_shows_them():
    row = format_timings([TIMING]).splitlines()[1]
    assert row.split() == ["single_free", "50", "µs", "500", "µs", "10.0", "1.25", "×"]


def test_an_experiment_is_timed_from_a_given_time_on(monkeypatch):
    monkeypatch.setattr(bench, "_WINDOWS", 1)
    monkeypatch.setattr(bench, "_WINDOW", 0.01)
    timing = time_experiment(get_experiment("plexiglas"), "start", 0.02)
    assert timing.step == 1e-3
    assert min(timing.loop, timing.logged) > timing.bare > 0.0


def test_the_command_writes_its_figures_as_json(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(bench, "time_experiment", lambda experiment, name, start: TIMING)
    file = tmp_path / "bench.json"
    assert cli.main(["bench", "--json", str(file)]) == 0
    data = json.loads(file.read_text())
    assert data["ratios"] == {"single_free": 10.0}
    assert data["real_time_factor"] == {"plexiglas": 1.25}
    assert data["microseconds_per_step"]["single_free"]["bare"] == 50.0
    assert "single_free" in capsys.readouterr().out
