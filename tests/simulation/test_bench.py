"""`geoimp bench`: what it reports. How fast anything is, no test judges."""

import dataclasses
import json

import pytest
from pydrake.systems.framework import Diagram

from geoimp_drake import cli
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.simulation import bench
from geoimp_drake.simulation.bench import (
    BenchCase,
    Timing,
    compare_bench,
    format_timings,
    time_experiment,
)

TIMING = Timing(
    "single_free",
    step=1e-3,
    loop=(500.0,),
    logged=(800.0,),
    bare=(50.0,),
    blocks=(600.0,),
    blocks_logged=(1000.0,),
)


def test_ratio_and_real_time_factor_are_those_of_the_timings():
    assert TIMING.ratio() == pytest.approx(10.0)
    assert TIMING.ratio("blocks", "loop") == pytest.approx(1.2)
    assert TIMING.real_time_factor() == pytest.approx(1.25)
    assert TIMING.real_time_factor("blocks_logged") == pytest.approx(1.0)


def test_a_ratio_is_of_windows_side_by_side():
    # In the second round the machine is half as fast, in the third something else disturbs.
    bare = (50.0, 100.0, 50.0)
    rounds = dataclasses.replace(TIMING, loop=(500.0, 1000.0, 900.0), bare=bare, blocks=bare)
    assert rounds.ratio() == 10.0
    assert "10.0" in format_timings([rounds])


def test_the_table_shows_them():
    row = format_timings([TIMING]).splitlines()[1]
    compiled, blocks = ["500", "µs", "10.0", "1.25", "×"], ["600", "µs", "12.0", "1.00", "×"]
    assert row.split() == ["single_free", "50", "µs", *compiled, *blocks]


def test_an_experiment_is_timed_from_a_given_time_on(monkeypatch):
    monkeypatch.setattr(bench, "_WINDOWS", 1)
    monkeypatch.setattr(bench, "_WINDOW", 0.01)
    timing = time_experiment(get_experiment("plexiglas"), "start", 0.02)
    assert timing.step == 1e-3
    loops = timing.loop, timing.logged, timing.blocks, timing.blocks_logged
    for windows in (*loops, timing.bare, timing.drake):
        assert len(windows) == 1
        assert windows[0] > 0.0


def test_both_forms_are_timed_with_and_without_a_log(monkeypatch):
    def advance(simulator):
        diagram = simulator.get_system()
        (controller,) = (s for s in diagram.GetSystems() if s.HasOutputPort("compliant_motion"))
        is_logged, is_blocks = diagram.HasSubsystemNamed("log"), isinstance(controller, Diagram)
        return lambda: 1.0 + is_logged + 2.0 * is_blocks

    monkeypatch.setattr(bench, "_WINDOWS", 1)
    monkeypatch.setattr(bench, "_advance", advance)
    monkeypatch.setattr(bench, "_timed", lambda run: run() or 1.0)
    timing = time_experiment(get_experiment("plexiglas"), "start", 0.01)
    loops = timing.loop, timing.logged, timing.blocks, timing.blocks_logged
    assert [loop[0] / timing.loop[0] for loop in loops] == [1.0, 2.0, 3.0, 4.0]
    assert timing.ratio() == 1.0


def test_a_loop_without_a_log_has_none_of_its_systems():
    for name in ("plexiglas", "bar", "peg_in_hole"):
        experiment = get_experiment(name)
        loops = [experiment.build(experiment.scenario(), logged=logged) for logged in (True, False)]
        with_log, without = (
            {system.get_name() for system in loop.diagram.GetSystems()} for loop in loops
        )
        only_for_the_log = {n for n in with_log if n.startswith("motion_of_")}
        assert with_log - without == {"logged_signals", "log"} | only_for_the_log
        assert only_for_the_log
        with pytest.raises(ConfigurationError, match="logged=True"):
            loops[1].recorder.collect(loops[1].diagram.CreateDefaultContext())


def test_drakes_own_controller_stands_beside_the_bare_plant():
    timing = dataclasses.replace(TIMING, drake=(75.0,))
    header, row = format_timings([timing]).splitlines()
    assert header.index("bare plant") < header.index("Drake ID") < header.index("closed loop")
    assert row.split()[1:5] == ["50", "µs", "75", "µs"]
    # A case that Drake's controller cannot drive has a dash, in the same columns.
    without, _ = format_timings([TIMING, timing]).splitlines()[1:]
    assert without.split()[1:4] == ["50", "µs", "–"]
    assert len(without) == len(row)


def test_what_got_slower_is_named_and_noise_is_not():
    old = {"ratios": {"single_free": 5.0, "redundant_free": 7.0, "gone": 1.0}}
    new = {"ratios": {"single_free": 5.4, "redundant_free": 8.0}}
    table = compare_bench(old, new)
    assert table.splitlines()[-1] == "slower: redundant_free"
    assert "gone" not in table
    assert compare_bench(new, old).splitlines()[-1] == "slower: nothing"


def test_further_cases_are_timed_and_their_factors_kept_by_experiment(monkeypatch, tmp_path):
    monkeypatch.setattr(
        bench,
        "time_experiment",
        lambda experiment, name, start: dataclasses.replace(
            TIMING, name=name, loop=(10.0 * start,), blocks=(20.0 * start,)
        ),
    )
    redundancy = get_experiment("redundancy")
    cases = [
        BenchCase("single_free", get_experiment("plexiglas"), 1.0),
        BenchCase("redundant_free", redundancy, 35.0, True),
    ]
    _, text = bench.run_bench(cases)
    data = json.loads(text)
    assert data["ratios"] == {"single_free": 0.2, "redundant_free": 7.0}
    assert data["ratios_blocks"] == {"single_free": 0.4, "redundant_free": 14.0}
    assert data["real_time_factor"] == {"redundancy": 1.25}
    assert data["real_time_factor_blocks"] == {"redundancy": 1.0}
    assert data["microseconds_per_step"]["single_free"]["drake"] is None


def test_the_command_writes_its_timings_as_json_and_compares_them(monkeypatch, tmp_path, capsys):
    def timing(experiment, name, start):
        return dataclasses.replace(TIMING, name=name)

    monkeypatch.setattr(bench, "time_experiment", timing)
    file = tmp_path / "bench.json"
    assert cli.main(["bench", "--json", str(file)]) == 0
    data = json.loads(file.read_text())
    assert {"single_free", "redundant_free", "bar_free"} <= data["ratios"].keys()
    assert data["ratios"]["single_free"] == 10.0
    assert data["real_time_factor"] == dict.fromkeys(
        ["plexiglas", "redundancy", "bar", "peg_in_hole"], 1.25
    )
    assert data["microseconds_per_step"]["single_free"]["bare"] == 50.0
    assert "single_free" in capsys.readouterr().out
    assert cli.main(["bench", "--compare", str(file)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "slower: nothing"


def test_cases_are_chosen_by_name(monkeypatch, capsys):
    monkeypatch.setattr(bench, "time_experiment", lambda experiment, name, start: TIMING)
    assert cli.main(["bench", "--only", "single_free"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 2
    assert cli.main(["bench", "--only", "bar_fre"]) == 2
    assert "Did you mean 'bar_free'?" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"ratios": {"single_free": "fast"}}'])
def test_a_file_to_compare_with_that_is_none_is_refused(text, tmp_path, capsys):
    file = tmp_path / "bench.json"
    file.write_text(text)
    assert cli.main(["bench", "--compare", str(file)]) == 2
    assert "does not hold the timings" in capsys.readouterr().err


def test_a_file_to_compare_with_that_is_not_there_is_named(tmp_path, capsys):
    assert cli.main(["bench", "--compare", str(tmp_path / "no.json")]) == 2
    assert "no.json cannot be read: No such file" in capsys.readouterr().err
