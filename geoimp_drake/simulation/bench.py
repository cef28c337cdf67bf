"""What the closed loop costs: microseconds a step, as ratios to the bare plant in the same run."""

import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.controllers import InverseDynamicsController
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, System
from pydrake.systems.primitives import ConstantVectorSource

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.simulation.garbage import only_new_garbage
from geoimp_drake.systems.arm.arm_model import ArmModel
from geoimp_drake.systems.part_system import PartSystem
from geoimp_drake.typing import Array

__all__ = [
    "BenchCase",
    "Timing",
    "compare_bench",
    "format_timings",
    "run_bench",
    "time_experiment",
]

_WINDOWS = 5
_WINDOW = 0.4  # [s] of simulated time

# Below this a change is taken for noise.
_SLOWER = 1.1


@dataclass(frozen=True)
class BenchCase:
    """What is timed.

    Attributes:
        name: of the ratio.
        experiment: of the catalogue.
        start: simulated time at which the windows begin [s].
        real_time: whether its real-time factor counts as the experiment's.
    """

    name: str
    experiment: Any
    start: float
    real_time: bool = False


@dataclass(frozen=True)
class Timing:
    """What was timed, in rounds: each times a window of the loop, of the bare plant and so on.

    Attributes:
        name: of the case.
        step: plant step [s].
        loop: closed loop, logging off [µs per plant step].
        logged: closed loop with the experiment's own logging [µs per plant step].
        bare: the plant alone under a constant torque, from the same state [µs per plant step].
        drake: the plant under Drake's own InverseDynamicsController, in C++ [µs per plant step];
            nothing if that takes no such plant.
    """

    name: str
    step: float
    loop: tuple[float, ...]
    logged: tuple[float, ...]
    bare: tuple[float, ...]
    drake: tuple[float, ...] = ()

    @property
    def ratio(self) -> float:
        """Closed loop over bare plant: the median of the rounds' ratios.

        A machine whose speed changes does so for both windows of a round.
        """
        return median(loop / bare for loop, bare in zip(self.loop, self.bare, strict=True))

    @property
    def real_time_factor(self) -> float:
        """Simulated over wall time, logging on."""
        return 1e6 * self.step / median(self.logged)


def run_bench(
    cases: Sequence[BenchCase], json_file: Path | None = None, earlier: Path | None = None
) -> str:
    """Times closed loops; returns a table, and what got slower since an earlier time.

    Args:
        cases: what is timed.
        json_file: where the figures are written, None for nowhere.
        earlier: such a file, None for no comparison.

    Raises:
        ConfigurationError: the earlier file is no such file; nothing has been timed.
    """
    before = None if earlier is None else _read(earlier)
    timings = [time_experiment(case.experiment, case.name, case.start) for case in cases]
    data = {
        "microseconds_per_step": {t.name: _figures(t) for t in timings},
        "ratios": {t.name: t.ratio for t in timings},
        "real_time_factor": {
            case.experiment.name: timing.real_time_factor
            for case, timing in zip(cases, timings, strict=True)
            if case.real_time
        },
    }
    if json_file is not None:
        json_file.write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")
    table = format_timings(timings)
    return table if before is None else f"{table}\n\n{compare_bench(before, data)}"


def _read(file: Path) -> dict[str, Any]:
    try:
        data: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        if not all(isinstance(ratio, float) for ratio in data["ratios"].values()):
            raise TypeError
    except OSError as error:
        raise ConfigurationError(f"{file} cannot be read: {error.strerror}.") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise ConfigurationError(
            f"{file} does not hold the figures of `geoimp bench --json FILE`."
        ) from None
    return data


def _figures(timing: Timing) -> dict[str, float | None]:
    return {
        "bare": median(timing.bare),
        "drake": median(timing.drake) if timing.drake else None,
        "loop": median(timing.loop),
        "loop_logged": median(timing.logged),
    }


def compare_bench(old: dict[str, Any], new: dict[str, Any]) -> str:
    """Returns what became slower from one run of `run_bench` to another, as a table.

    Ratios to the bare plant are compared, not microseconds, so that another machine or another load
    do not count; a change of less than a tenth is taken for noise.

    Args:
        old: the JSON data of the earlier run.
        new: of the later one.
    """
    common = [name for name in old["ratios"] if name in new["ratios"]]
    rows = [(name, old["ratios"][name], new["ratios"][name]) for name in common]
    lines = [f"{'case':16}{'before':>9}{'now':>9}"]
    lines += [
        f"{name:16}{before:9.1f}{now:9.1f}  {'slower' if now > _SLOWER * before else ''}".rstrip()
        for name, before, now in rows
    ]
    slower = [name for name, before, now in rows if now > _SLOWER * before]
    lines.append(f"slower: {', '.join(slower) or 'nothing'}")
    return "\n".join(lines)


def time_experiment(experiment: Any, name: str, start: float) -> Timing:
    """Times an experiment from a given time on.

    Args:
        experiment: of the catalogue.
        name: of the case.
        start: simulated time at which the windows begin [s].
    """
    loop = _loop(experiment, start, logged=False)
    logged = _loop(experiment, start, logged=True)
    advance = {
        "loop": _advance(loop[0]),
        "logged": _advance(logged[0]),
        "bare": _bare_plant(*loop[1:]),
        "drake": _under_drakes_controller(*loop[1:]),
    }
    step = loop[1].scenario.plant.time_step
    micro: dict[str, tuple[float, ...]] = dict.fromkeys(advance, ())
    with only_new_garbage():  # as `simulate` does
        for _ in range(_WINDOWS):
            for key, run in advance.items():
                if run is not None:
                    micro[key] += (_timed(run) * step / _WINDOW * 1e6,)
    return Timing(name, step, **micro)


def format_timings(timings: list[Timing]) -> str:
    """Returns the timings as a table for a terminal."""
    with_drake = any(t.drake for t in timings)
    drake = f"{'Drake ID':>12}" if with_drake else ""
    lines = [
        f"{'case':16}{'bare plant':>12}{drake}{'closed loop':>13}{'ratio':>8}{'real time':>12}"
    ]
    for t in timings:
        known = f"{median(t.drake):9.0f} µs" if t.drake else f"{'–':>12}"
        drake = known if with_drake else ""
        lines.append(
            f"{t.name:16}{median(t.bare):9.0f} µs{drake}{median(t.loop):10.0f} µs{t.ratio:8.1f}"
            f"{t.real_time_factor:10.2f} ×"
        )
    return "\n".join(lines)


def _loop(experiment: Any, start: float, *, logged: bool) -> tuple[Simulator, Any, Any]:
    """Returns a closed loop that has been advanced to a time: simulator, set-up, its context."""
    setup = experiment.build(experiment.scenario(), logged=logged)
    simulator = Simulator(setup.diagram)
    ApplySimulatorConfig(setup.scenario.simulator, simulator)
    simulator.AdvanceTo(start)
    return simulator, setup, simulator.get_context()


def _bare_plant(setup: Any, context: Context) -> Callable[[], None]:
    """Returns what advances the plant alone by a window, each time from the closed loop's state."""
    builder = DiagramBuilder()
    plant: MultibodyPlant = setup.add_plant(builder)
    torque: Array = setup.plant.get_net_actuation_output_port().Eval(
        setup.plant.GetMyContextFromRoot(context)
    )
    source = builder.AddNamedSystem("holding_torque", ConstantVectorSource(torque))
    builder.Connect(source.get_output_port(), plant.get_actuation_input_port())
    return _from_state_of(setup, context, builder, plant)


def _under_drakes_controller(setup: Any, context: Context) -> Callable[[], None] | None:
    """Returns the same with Drake's inverse dynamics controller for each arm, None if impossible.

    That controller takes the arm's state in its own model's order.
    """
    builder = DiagramBuilder()
    plant: MultibodyPlant = setup.add_plant(builder)
    plant_context = setup.plant.GetMyContextFromRoot(context)
    driven = 0
    for model in _arm_models(setup.diagram):
        n = model.num_joints
        arm = plant.GetModelInstanceByName(
            model.plant.GetModelInstanceName(model.end_effector.model_instance())
        )
        if list(model.state_order) != list(range(2 * n)):
            return None
        driven += n
        controller = builder.AddSystem(
            InverseDynamicsController(model.plant, [100.0] * n, [0.0] * n, [20.0] * n, False)
        )
        desired = setup.plant.GetPositionsAndVelocities(plant_context, arm) * (
            [1.0] * n + [0.0] * n
        )
        source = builder.AddSystem(ConstantVectorSource(desired))
        builder.Connect(source.get_output_port(), controller.get_input_port_desired_state())
        builder.Connect(
            plant.get_state_output_port(arm), controller.get_input_port_estimated_state()
        )
        builder.Connect(controller.get_output_port_control(), plant.get_actuation_input_port(arm))
    if driven != plant.num_actuators():
        return None
    return _from_state_of(setup, context, builder, plant)


def _arm_models(diagram: Diagram) -> Iterator[ControlModel]:
    """Yields the control models of the arms anywhere in a diagram."""
    system: System
    for system in diagram.GetSystems():
        if isinstance(system, ArmModel):
            yield system.model
        elif isinstance(system, PartSystem):
            yield from getattr(system.part, "models", ())
        elif isinstance(system, Diagram):
            yield from _arm_models(system)


def _from_state_of(
    setup: Any, context: Context, builder: DiagramBuilder, plant: MultibodyPlant
) -> Callable[[], None]:
    """Returns what advances a diagram by a window, each time from the closed loop's state."""
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
