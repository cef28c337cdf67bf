"""Advancing a diagram to a given time, with a progress bar on a terminal."""

import heapq
import logging
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from pydrake.systems.analysis import (
    ApplySimulatorConfig,
    Simulator,
    SimulatorConfig,
    SimulatorStatus,
)
from pydrake.systems.framework import Context, Diagram
from tqdm import tqdm

from geoimp_drake.errors import ModelError, drake_errors
from geoimp_drake.simulation.garbage import only_new_garbage

__all__ = ["Event", "Outcome", "simulate"]

_log = logging.getLogger("drake")

# The simulation advances in chunks of this length [s], with or without a progress bar, so that both
# give the same result to the bit.
_CHUNK = 0.1

_TERMINATED = SimulatorStatus.ReturnReason.kReachedTerminationCondition


@dataclass(frozen=True)
class Event:
    """Something that happens to the diagram from outside, such as a grasp that opens.

    Attributes:
        time: when it happens [s]; an event at zero happens before the diagram is initialized.
        apply: changes the context of the whole diagram.
    """

    time: float
    apply: Callable[[Context], None]


@dataclass
class Outcome:
    """How a simulation ended.

    Attributes:
        context: of the whole diagram, at the time that was reached.
        failure: the error that stopped it before its end, if any.
    """

    context: Context
    failure: Exception | None = None

    @property
    def time(self) -> float:
        """The time that was reached [s]."""
        return float(self.context.get_time())


def simulate(
    diagram: Diagram,
    config: SimulatorConfig,
    duration: float,
    *,
    label: str = "",
    real_time: bool = False,
    events: Sequence[Event] = (),
    wait: Callable[[], bool] | None = None,
) -> Outcome:
    """Simulates a diagram from its default context.

    Args:
        diagram: the one to simulate.
        config: Drake's integrator and real-time settings.
        duration: time to reach [s], unless a system of the diagram ends the simulation before.
        label: text before the progress bar, which is shown only on a terminal.
        real_time: do not run faster than real time.
        events: events during the simulation, which stops at each of them.
        wait: called between chunks; may pause the simulation, and returns whether it did.

    Returns:
        The outcome; an error of a system or of Drake ends the simulation and is kept in it.
    """
    simulator = Simulator(diagram)
    outcome = Outcome(simulator.get_context())
    try:
        ApplySimulatorConfig(config, simulator)
        if real_time:
            simulator.set_target_realtime_rate(1.0)
        bar = tqdm(
            total=duration,
            desc=label,
            unit="s",
            disable=not sys.stderr.isatty(),
            bar_format="{desc} {bar} {n:.1f}/{total:.1f} s simulated, {remaining} left",
        )
        with drake_errors(ModelError, "Drake cannot go on", raised=()), bar, only_new_garbage():
            for event in events:
                if event.time == 0.0:
                    event.apply(simulator.get_mutable_context())
            simulator.Initialize()
            for end in _stops(duration, events):
                status = simulator.AdvanceTo(end)
                bar.update(simulator.get_context().get_time() - bar.n)
                if wait is not None and wait():
                    simulator.ResetStatistics()  # so that lost real time is not made up for
                for event in events:
                    if event.time == end:
                        event.apply(simulator.get_mutable_context())
                if status.reason() == _TERMINATED:
                    break
    except (RuntimeError, ValueError) as error:
        outcome.failure = error
        if outcome.time > 0.0:
            _log.error(f"Stopped at t = {outcome.time:.3f} s: {error}")
    return outcome


def _stops(duration: float, events: Sequence[Event]) -> Iterator[float]:
    """Yields the times to which the simulation advances in turn: those of chunks and of events."""
    chunks = (_CHUNK * (k + 1) for k in range(int(duration / _CHUNK)))
    before = -math.inf
    times = sorted(event.time for event in events if event.time > 0.0)
    for time in heapq.merge(chunks, times, [duration]):
        if before < (time := min(time, duration)):
            yield time
            before = time
