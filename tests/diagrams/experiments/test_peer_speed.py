"""What is told of ticks and closed loops that were timed; how fast anything is, no test judges."""

import json

import pytest

from geoimp_drake.campaigns.journal import Finished
from geoimp_drake.diagrams.experiments import peer_speed
from geoimp_drake.simulation.claims import FAILS, HOLDS

TICKS = {
    "microseconds_per_tick": {
        "six joints": {"loop": 12.0, "drake": 5.0, "osc": 57.0, "robosuite": 78.0},
        "two arms": {"loop": 58.5},
    },
    "difference_of_torques": {"six joints": 1e-11, "two arms": None},
}
LOOP = {
    "microseconds_per_step": {
        "plexiglas": {"bare": 50.0, "drake": None, "loop": 100.0, "blocks": 400.0}
    },
    "ratios": {"plexiglas": 2.0},
    "ratios_blocks": {"plexiglas": 8.0},
    "real_time_factor": {"plexiglas": 7.0},
    "real_time_factor_blocks": {"plexiglas": 1.5},
}


@pytest.fixture
def timed(monkeypatch):
    """Has timings in the place of what would be timed; returns what was, and with how many jobs."""
    asked = []

    def run_many(tasks, function, *, jobs, **_):
        asked.append((list(tasks), jobs))
        timings = {"tick": TICKS, "plexiglas": LOOP}
        ended = {
            key: Finished({"identity": "", "timings": timings[key], "load": 1.5}, None, 0.0)
            for key in tasks
            if key in timings
        }
        return ended | {
            key: Finished(None, "MemoryError", 0.0) for key in tasks if key not in timings
        }

    monkeypatch.setattr(peer_speed, "run_many", run_many)
    return asked


def test_tables_have_a_row_a_tick_and_a_row_a_closed_loop(timed, tmp_path):
    result = peer_speed.SpeedSection(quick=True).run(tmp_path, 4, ())
    assert timed == [(["tick", "single_free", "plexiglas"], 1)]  # one after the other
    ticks, loops, machine = result.tables
    assert ticks.head[:3] == ("a tick of", "six joints [µs]", "two arms [µs]")
    cells = {row[0]: row[1:3] for row in ticks.rows}
    assert cells["ControlLoop.step"] == ("12", "58.5")
    assert cells["robosuite, run_controller"] == ("57", "–")
    assert "pinocchio and NumPy" not in cells  # it was not there
    assert all(len(row) == len(ticks.head) and row[-1] for row in ticks.rows)
    assert loops.rows == (("plexiglas", "50", "–", "100", "400", "2", "8", "7", "1.5"),)
    assert len(loops.head) == 9
    told = dict(machine.rows)
    assert told["drake"] == peer_speed.version("drake")
    assert told["processes that wanted to run meanwhile"] == "1.5 to 1.5"
    assert result.failures == {"single_free": "MemoryError"}
    data = json.loads((tmp_path / "speed.json").read_text("utf-8"))
    assert data["machine"]["processor"] == told["processor"]
    assert {path.name for path in tmp_path.iterdir()} < set(result.files) | set(
        peer_speed.SpeedSection.files
    )


@pytest.mark.parametrize(("off", "verdict"), [(1e-11, HOLDS), (1e-3, FAILS)])
def test_a_peer_must_give_the_same_torques(timed, tmp_path, monkeypatch, off, verdict):
    monkeypatch.setitem(TICKS["difference_of_torques"], "six joints", off)
    (judged,) = peer_speed.SpeedSection(quick=True).run(tmp_path, 1, ()).judged()
    assert judged.verdict == verdict


def test_what_was_timed_elsewhere_is_timed_again(monkeypatch):
    monkeypatch.setattr(peer_speed, "run_tick_bench", lambda: ("", json.dumps(TICKS)))
    monkeypatch.setattr(
        peer_speed, "run_bench", lambda cases: ("", json.dumps({"case": cases[0].name}))
    )
    tick, loop = peer_speed.time_speed("tick"), peer_speed.time_speed("bar")
    assert (tick["timings"], loop["timings"]) == (TICKS, {"case": "bar"})
    assert tick["identity"] != loop["identity"]
    monkeypatch.setattr(peer_speed, "_processor", lambda: "another machine")
    assert peer_speed.time_speed("tick")["identity"] != tick["identity"]
