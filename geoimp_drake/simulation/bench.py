"""What the closed loop costs: microseconds a step, as ratios to the bare plant in the same run."""

import json
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import Context, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from geoimp_drake.typing import Array

__all__ = ["Timing", "format_timings", "run_bench", "time_experiment"]

_WINDOWS = 5
_WINDOW = 0.2  # [s] of simulated time
_NO_LOG = 1e6  # [s]


@dataclass(frozen=True)
class Timing:
    """Medians over windows that alternate between closed loop and bare plant.

    Attributes:
        name: of the case.
        loop: closed loop, logging off [µs per plant step].
        logged: closed loop with the experiment's own logging [µs per plant step].
        bare: the plant alone under a constant torque, from the same state [µs per plant step].
        step: plant step [s].
    """

    name: str
    loop: float
    logged: float
    bare: float
    step: float

    @property
    def ratio(self) -> float:
        """Closed loop over bare plant."""
        return self.loop / self.bare

    @property
    def real_time_factor(self) -> float:
        """Simulated over wall time, logging on."""
        return 1e6 * self.step / self.logged


def run_bench(json_file: Path | None, experiment: Any) -> str:
    """Times the closed loop, free and in contact; returns a table, writes JSON if asked to.

    Args:
        json_file: where to write, None for nowhere.
        experiment: `plexiglas` of the catalogue.
    """
    timings = [
        time_experiment(experiment, "single_free", 1.0),
        time_experiment(experiment, "single_contact", 6.0),
    ]
    if json_file is not None:
        data = {
            "microseconds_per_step": {
                t.name: {"bare": t.bare, "loop": t.loop, "loop_logged": t.logged} for t in timings
            },
            "ratios": {t.name: t.ratio for t in timings},
            "real_time_factor": {"plexiglas": timings[-1].real_time_factor},
        }
        json_file.write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")
    return format_timings(timings)


def time_experiment(experiment: Any, name: str, start: float) -> Timing:
    """Times an experiment from a given time on.

    Args:
        experiment: of the catalogue.
        name: of the case.
        start: simulated time at which the windows begin [s].
    """
    loop = _loop(experiment, (f"log_period={_NO_LOG}",), start)
    logged = _loop(experiment, (), start)
    bare = _bare_plant(*loop[1:])
    advance = {
        "loop": _advance(loop[0]),
        "logged": _advance(logged[0]),
        "bare": bare,
    }
    seconds: dict[str, list[float]] = {key: [] for key in advance}
    for _ in range(_WINDOWS):
        for key, run in advance.items():
            seconds[key].append(_timed(run))
    step = loop[1].scenario.plant.time_step
    micro = {key: statistics.median(s) * step / _WINDOW * 1e6 for key, s in seconds.items()}
    return Timing(name, micro["loop"], micro["logged"], micro["bare"], step)


def format_timings(timings: list[Timing]) -> str:
    """Returns the timings as a table for a terminal."""
    lines = [f"{'case':16}{'bare plant':>12}{'closed loop':>13}{'ratio':>8}{'real time':>12}"]
    lines += [
        f"{t.name:16}{t.bare:9.0f} µs{t.loop:10.0f} µs{t.ratio:8.1f}{t.real_time_factor:10.2f} ×"
        for t in timings
    ]
    return "\n".join(lines)


def _loop(experiment: Any, overrides: tuple[str, ...], start: float) -> tuple[Simulator, Any, Any]:
    """Returns a closed loop that has been advanced to a time: simulator, set-up, its context."""
    setup = experiment.build(experiment.scenario((), overrides))
    simulator = Simulator(setup.diagram)
    ApplySimulatorConfig(setup.scenario.simulator, simulator)
    simulator.AdvanceTo(start)
    return simulator, setup, simulator.get_context()


def _bare_plant(setup: Any, context: Context) -> Callable[[], None]:
    """Returns what advances the plant alone by a window, each time from the closed loop's state."""
    builder = DiagramBuilder()
    plant: MultibodyPlant = setup.add_plant(builder)
    arm = plant.GetModelInstanceByName(setup.scenario.arm)
    torque: Array = setup.controller.GetOutputPort("actuation").Eval(
        setup.controller.GetMyContextFromRoot(context)
    )
    source = builder.AddNamedSystem("holding_torque", ConstantVectorSource(torque))
    builder.Connect(source.get_output_port(), plant.get_actuation_input_port(arm))
    simulator = Simulator(builder.Build())
    plant_context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    state = setup.plant.GetPositionsAndVelocities(setup.plant.GetMyContextFromRoot(context))

    def run() -> None:
        simulator.get_mutable_context().SetTime(0.0)
        plant.SetPositionsAndVelocities(plant_context, state)
        simulator.Initialize()
        simulator.AdvanceTo(_WINDOW)

    return run


def _advance(simulator: Simulator) -> Callable[[], None]:
    return lambda: simulator.AdvanceTo(simulator.get_context().get_time() + _WINDOW)


def _timed(run: Callable[[], None]) -> float:
    start = time.perf_counter()
    run()
    return time.perf_counter() - start
