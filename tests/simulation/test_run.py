"""A run advances in chunks to events and its end, however long it is."""

import pytest
from pydrake.systems.analysis import SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from geoimp_drake.simulation.run import Event, simulate


def run(duration: float, events: tuple[float, ...] = (), most: int = 1000):
    """Returns the times of chunks and events, and the outcome; stopped after so many chunks."""
    builder = DiagramBuilder()
    builder.AddSystem(ConstantVectorSource([0.0]))
    chunks, happened = [], []

    def wait() -> bool:
        chunks.append(len(chunks))
        if len(chunks) == most:
            raise RuntimeError("enough")
        return False

    outcome = simulate(
        builder.Build(),
        SimulatorConfig(max_step_size=0.1),
        duration,
        events=[Event(t, lambda c: happened.append(c.get_time())) for t in events],
        wait=wait,
    )
    return len(chunks), happened, outcome


def test_a_run_stops_at_its_chunks_events_and_end_once_each():
    chunks, happened, outcome = run(0.35, events=(0.27, 0.1, 9.0))
    assert chunks == 5  # 0.1, 0.2, 0.27, 0.3, 0.35
    assert happened == pytest.approx([0.1, 0.27])
    assert outcome.failure is None
    assert outcome.time == 0.35


def test_a_run_of_ages_begins_at_once():
    """Its stops, 10^13 of them, are made as they come."""
    chunks, _, outcome = run(1e12, most=3)
    assert (chunks, str(outcome.failure)) == (3, "enough")
    assert outcome.time == pytest.approx(0.3)
