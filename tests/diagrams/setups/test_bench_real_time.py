"""What is said of the latencies on LCM, and that they are measured; none is asserted."""

import json
import sys

import numpy as np
import pytest
from lcm_trial import isolated

from geoimp_drake.diagrams.setups.bench_real_time import Latency, format_latencies

SHORT = """
from geoimp_drake.diagrams.setups.bench_real_time import run_real_time_bench
print(run_real_time_bench(duration=0.3)[1])
"""


def test_percentiles_and_missed_statuses():
    some = Latency(1e-3, np.arange(1.0, 1000.0), 2000, "SCHED_FIFO 80", 1.25)
    assert some.summary()["median"] == 500.0
    assert some.summary()["missed"] == pytest.approx(1001 / 2000)
    none = Latency(5e-3, np.zeros(0), 10, "SCHED_OTHER", 0.5)
    _, first, second = format_latencies([some, none]).splitlines()
    assert first.split()[:4] == ["1000", "Hz", "500", "µs"]
    assert first.endswith("50.05%  SCHED_FIFO 80, load 1.2")
    assert second.split()[2:6] == ["–", "–", "–", "100.00%"]


def test_each_rate_is_measured():
    found = json.loads(isolated(sys.executable, "-c", SHORT))
    assert list(found) == ["200 Hz", "1000 Hz"]
    for known in found.values():
        assert 0.0 <= known["missed"] <= 1.0
        assert known["scheduler"].startswith("SCHED")
