"""Advancing a diagram to a given time, with a progress bar on a terminal."""

import logging
import sys
from dataclasses import dataclass

from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import Context, Diagram
from tqdm import tqdm

__all__ = ["Outcome", "simulate"]

_log = logging.getLogger("drake")

# The simulation advances in chunks of this length [s], bar or no bar, so that both give the same
# result to the bit.
_CHUNK = 0.1


@dataclass
class Outcome:
    """How a simulation ended.

    Attributes:
        context: of the whole diagram, at the time that was reached.
        failure: what stopped it before its end, if anything did.
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
) -> Outcome:
    """Simulates a diagram from its default context.

    Args:
        diagram: what is simulated.
        config: Drake's integrator and real-time settings.
        duration: time to reach [s].
        label: stands before the progress bar, which is shown on a terminal only.
        real_time: do not run faster than real time.

    Returns:
        The outcome; an error of a system or of Drake ends the simulation and is kept there.
    """
    simulator = Simulator(diagram)
    outcome = Outcome(simulator.get_context())
    try:
        ApplySimulatorConfig(config, simulator)
        if real_time:
            simulator.set_target_realtime_rate(1.0)
        simulator.Initialize()
        with tqdm(
            total=duration,
            desc=label,
            unit="s",
            disable=not sys.stderr.isatty(),
            bar_format="{desc} {bar} {n:.1f}/{total:.1f} s simulated, {remaining} left",
        ) as bar:
            chunks = int(duration / _CHUNK)
            for end in [*(_CHUNK * (k + 1) for k in range(chunks)), duration]:
                simulator.AdvanceTo(min(end, duration))
                bar.update(simulator.get_context().get_time() - bar.n)
    except (RuntimeError, ValueError) as error:
        outcome.failure = error
        if outcome.time > 0.0:
            _log.error(f"Stopped at t = {outcome.time:.3f} s: {error}")
    return outcome
