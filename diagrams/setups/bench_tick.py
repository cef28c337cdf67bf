"""The cost of a tick on a robot: the controller called by hand, beside others."""

import json
import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import median

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.controllers import InverseDynamics
from pydrake.systems.framework import BasicVector

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.start_posture import find_start_posture
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.controllers.cooperative_control_loop import CooperativeControlLoop
from geoimp_drake.diagrams.setups.pinocchio_tick import PinocchioTick
from geoimp_drake.diagrams.setups.robosuite_tick import RobosuiteTick
from geoimp_drake.models import model_path
from geoimp_drake.robot_files.loading import load_robot
from geoimp_drake.simulation.garbage import only_new_garbage
from geoimp_drake.systems.frame_motion import frame_motion_at_rest
from geoimp_drake.task_functions.config import TaskConfig
from geoimp_drake.typing import Array

__all__ = ["TickTiming", "format_ticks", "run_tick_bench", "time_ticks"]

_ROUNDS, _CALLS = 15, 300
_MODELS = {"six joints": "six_joint_arm", "seven joints": "seven_joint_arm"}
_PUSH = np.array([0.01, -0.006, 0.008, 0.3, -0.4, 0.25])

# The ticks that are timed beside the loop, and their headings in a table.
_COLUMNS = {
    "loop": "ControlLoop",
    "drake": "Drake ID",
    "terms": "pin. terms",
    "numpy": "pin. + NumPy",
    "osc": "robosuite OSC",
    "robosuite": "OSC + MuJoCo",
}

_log = logging.getLogger("drake")


@dataclass(frozen=True)
class TickTiming:
    """Medians of hot calls in rounds that take turns [µs].

    Attributes:
        name: of the case.
        micro: times by round. `loop` is the whole tick of ControlLoop, `drake` its InverseDynamics
            alone. `terms` is pinocchio's terms alone, `numpy` the whole tick with these, in NumPy.
            `osc` is robosuite's controller alone, `robosuite` that with MuJoCo's terms and a new
            goal. Ticks that cannot be timed are left out.
        difference: between the torques of `loop` and of `numpy` [Nm], None without it.
    """

    name: str
    micro: dict[str, list[float]]
    difference: float | None = None

    def ratio(self) -> float | None:
        """The time of pinocchio with NumPy divided by the loop's; None without it."""
        if "numpy" not in self.micro:
            return None
        pairs = zip(self.micro["numpy"], self.micro["loop"], strict=True)
        return median(other / own for other, own in pairs)


def run_tick_bench() -> tuple[str, str]:
    """Times ticks for six and seven joints, and for two arms; returns a table, and JSON."""
    if RobosuiteTick.missing():
        _log.info(RobosuiteTick.missing())
    timings = [_of_one_arm(name, model) for name, model in _MODELS.items()]
    timings.append(TickTiming("two arms", time_ticks({"loop": _two_arms()})))
    data = {
        "microseconds_per_tick": {
            t.name: {key: median(rounds) for key, rounds in t.micro.items()} for t in timings
        },
        "pinocchio_with_numpy_over_loop": {t.name: t.ratio() for t in timings},
        "difference_of_torques": {t.name: t.difference for t in timings},
    }
    return format_ticks(timings), json.dumps(data, indent=2) + "\n"


def time_ticks(
    ticks: Mapping[str, Callable[[], object]], rounds: int = _ROUNDS, calls: int = _CALLS
) -> dict[str, list[float]]:
    """Returns the median time of a call [µs] in each round, by name.

    Args:
        ticks: the functions to call.
        rounds: number of rounds; in each, all take their turns.
        calls: number of calls of each in a round.
    """
    micro: dict[str, list[float]] = {name: [] for name in ticks}
    with only_new_garbage():
        for _ in range(rounds):
            for name, tick in ticks.items():
                micro[name].append(median(_timed(tick) for _ in range(calls)))
    return micro


def format_ticks(timings: list[TickTiming]) -> str:
    """Returns the timings as a table for a terminal."""
    lines = [
        f"{'tick':14}" + "".join(f"{title:>15}" for title in _COLUMNS.values()) + f"{'ratio':>8}"
    ]
    for t in timings:
        cells = (
            f"{median(t.micro[key]):12.1f} µs" if key in t.micro else f"{'–':>15}"
            for key in _COLUMNS
        )
        ratio = t.ratio()
        lines.append(f"{t.name:14}{''.join(cells)}" + (f"{ratio:8.1f}" if ratio else f"{'–':>8}"))
    return "\n".join(lines)


def _timed(tick: Callable[[], object]) -> float:
    start = time.perf_counter()
    tick()
    return 1e6 * (time.perf_counter() - start)


def _of_one_arm(name: str, model: str) -> TickTiming:
    plant = MultibodyPlant(1e-3)
    file = model_path(model)
    robot = load_robot(file, plant, end_effector="flange", geometry="leave-out")
    plant.Finalize()
    arm, E = robot.model_instance, robot.end_effector_frame
    q = find_start_posture(ControlModel.of_arm(plant, arm, E))
    v = np.linspace(-0.1, 0.1, len(q))
    config = ImpedanceControllerConfig()
    config.redundancy.task = TaskConfig()  # the chapter's damping alone, as in pinocchio's tick
    loop = ControlLoop(plant, arm, E, config)
    D = frame_motion_at_rest(loop.pose(q))
    ticks: dict[str, Callable[[], object]] = {
        "loop": lambda: loop.step(q, v, _PUSH, D),
        "drake": _drakes(loop.model, q, v),
    }
    difference = None
    if PinocchioTick.is_available():
        pinocchio = PinocchioTick(file, loop.model)
        difference = _difference(loop, pinocchio, (q, v, _PUSH, D))
        ticks["terms"] = lambda: pinocchio.terms(q, v)
        ticks["numpy"] = lambda: pinocchio.step(q, v, _PUSH, D)
    if not RobosuiteTick.missing():
        robosuite = RobosuiteTick(model, E, loop.model.joint_names)
        robosuite.reset(q, v, D)
        ticks["osc"] = robosuite.controller
        ticks["robosuite"] = lambda: robosuite.step(q, v)
    loop.reset(q, v, _PUSH, D)
    return TickTiming(name, time_ticks(ticks), difference)


def _difference(
    loop: ControlLoop, pinocchio: PinocchioTick, signals: tuple[Array, Array, Array, Array]
) -> float:
    """Returns the largest difference of torques over the first ticks [Nm]."""
    q, v, h, D = signals
    loop.reset(q, v, h, D)
    pinocchio.reset(q)
    pairs = [(loop.step(*signals), pinocchio.step(*signals)) for _ in range(20)]
    return float(max(np.abs(one - other).max() for one, other in pairs))


def _drakes(model: ControlModel, q: Array, v: Array) -> Callable[[], object]:
    """Returns a function that evaluates Drake's inverse dynamics for a new state."""
    system = InverseDynamics(model.plant)
    context = system.CreateDefaultContext()
    acceleration = np.zeros(len(v))
    system.get_input_port_desired_acceleration().FixValue(context, acceleration)
    state = system.get_input_port_estimated_state().FixValue(context, np.concatenate((q, v)))
    output, x = system.get_output_port_generalized_force(), np.concatenate((q, v))

    def tick() -> Array:
        state.GetMutableData().set_value(BasicVector(x))
        torque: Array = output.Eval(context)
        return torque

    return tick


def _two_arms() -> Callable[[], object]:
    plant = MultibodyPlant(1e-3)
    robots = [
        load_robot(
            model_path(model),
            plant,
            end_effector="flange",
            name=f"arm_{k}",
            base_pose=RigidTransform(RollPitchYaw(0.0, 0.0, side * np.pi / 2), [0.0, y, 0.0]),
            geometry="leave-out",
        )
        for k, (model, side, y) in enumerate(
            zip(_MODELS.values(), (1.0, -1.0), (0.0, 3.2), strict=True), 1
        )
    ]
    plant.Finalize()
    arms = [robot.model_instance for robot in robots]
    frames = [robot.end_effector_frame for robot in robots]
    q = [
        find_start_posture(ControlModel.of_arm(plant, arm, E))
        for arm, E in zip(arms, frames, strict=True)
    ]
    v = [np.zeros(len(values)) for values in q]
    for arm, values in zip(arms, q, strict=True):
        plant.SetDefaultPositions(arm, values)
    loop = CooperativeControlLoop(plant, arms, frames)
    loop.reset(q, v)
    D, h = loop.output("object_motion").copy(), [np.zeros(6), np.zeros(6)]
    return lambda: loop.step(q, v, h, D)
