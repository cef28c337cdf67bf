"""What is said of a tick: medians, a ratio, and a dash for what is not there."""

import json

import numpy as np
import pytest

from geoimp_drake.diagrams.setups.bench_tick import (
    TickTiming,
    format_ticks,
    run_tick_bench,
    time_ticks,
)
from geoimp_drake.diagrams.setups.pinocchio_tick import PinocchioTick
from geoimp_drake.diagrams.setups.robosuite_tick import RobosuiteTick


def test_the_ratio_is_the_median_of_the_rounds():
    timing = TickTiming("six joints", {"loop": [10.0, 20.0, 10.0], "numpy": [100.0, 100.0, 90.0]})
    assert timing.ratio() == 9.0
    table = format_ticks([timing, TickTiming("two arms", {"loop": [30.0]})])
    assert [line.split() for line in table.splitlines()[1:]] == [
        ["six", "joints", "10.0", "µs", "–", "–", "100.0", "µs", "–", "–", "9.0"],
        ["two", "arms", "30.0", "µs", "–", "–", "–", "–", "–", "–"],
    ]


def test_ticks_take_turns():
    order = []
    micro = time_ticks({"a": lambda: order.append("a"), "b": lambda: order.append("b")}, 2, 3)
    assert "".join(order) == "aaabbbaaabbb"
    assert {name: len(rounds) for name, rounds in micro.items()} == {"a": 2, "b": 2}


def test_each_case_is_timed_and_peers_only_where_they_are(monkeypatch, caplog):
    caplog.set_level("INFO")
    monkeypatch.setattr(time_ticks, "__defaults__", (1, 20))
    table, text = run_tick_bench()
    data = json.loads(text)
    micro = data["microseconds_per_tick"]
    assert list(micro) == ["six joints", "seven joints", "two arms"]
    has_pinocchio = PinocchioTick.is_available()
    missing = RobosuiteTick.missing()
    assert not missing or missing in caplog.messages
    timed = {"loop", "drake"}
    timed |= {"terms", "numpy"} if has_pinocchio else set()
    timed |= set() if missing else {"osc", "robosuite"}
    for name in ("six joints", "seven joints"):
        assert set(micro[name]) == timed
        difference = data["difference_of_torques"][name]
        assert difference == (pytest.approx(0.0, abs=1e-8) if has_pinocchio else None)
    assert np.isfinite([value for case in micro.values() for value in case.values()]).all()
    assert table.count("–") == 6 + (0 if has_pinocchio else 6) + (4 if missing else 0)
