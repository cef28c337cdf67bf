"""The latency of commands on LCM: from a status to the torques that answer it, at a given rate."""

import json
import logging
import multiprocessing
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection

import numpy as np
from drake import lcmt_iiwa_command
from pydrake.lcm import DrakeLcm
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.start_posture import find_start_posture
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.models import model_path
from geoimp_drake.robot_files.loading import load_robot
from geoimp_drake.robots.lcm_arm import LcmArm
from geoimp_drake.robots.lcm_messages import LCM_MESSAGES
from geoimp_drake.robots.real_time import real_time, scheduler
from geoimp_drake.robots.robot_arm import RobotStatus
from geoimp_drake.systems.frame_motion import frame_motion_at_rest
from geoimp_drake.typing import Array

__all__ = ["Latency", "format_latencies", "run_real_time_bench"]

_PERIODS = (5e-3, 1e-3)
_DURATION = 10.0
_PERCENTILES = {"median": 50.0, "p99": 99.0, "p99.9": 99.9}

# After this time without a status it checks the other process [s].
_PATIENCE = 0.5


@dataclass(frozen=True)
class Latency:
    """The latencies at one rate.

    Attributes:
        period: of the statuses [s].
        micro: from a status to its command, of the commands in time [µs].
        sent: number of statuses.
        scheduler: of the loop.
        load: of the machine, mean over the last minute.
    """

    period: float
    micro: Array
    sent: int
    scheduler: str
    load: float

    def summary(self) -> dict[str, float | str | None]:
        """Returns percentiles [µs], the share of missed statuses, scheduler and load."""
        known = {
            name: float(np.percentile(self.micro, share)) if len(self.micro) else None
            for name, share in _PERCENTILES.items()
        }
        missed = 1.0 - len(self.micro) / self.sent
        return {**known, "missed": missed, "scheduler": self.scheduler, "load": self.load}


def run_real_time_bench(
    periods: Sequence[float] = _PERIODS, duration: float = _DURATION
) -> tuple[str, str]:
    """Measures latencies on this machine's loopback; returns a table, and JSON.

    Args:
        periods: of the statuses [s].
        duration: at each [s].
    """
    latencies = [_measure(period, duration) for period in periods]
    data = {f"{1 / known.period:.0f} Hz": known.summary() for known in latencies}
    return format_latencies(latencies), json.dumps(data, indent=2) + "\n"


def format_latencies(latencies: Sequence[Latency]) -> str:
    """Returns latencies as a table for a terminal."""
    lines = [f"{'LCM':10}" + "".join(f"{name:>12}" for name in (*_PERCENTILES, "missed"))]
    for known in latencies:
        summary = known.summary()
        cells = (
            f"{'–':>12}" if summary[name] is None else f"{summary[name]:9.0f} µs"
            for name in _PERCENTILES
        )
        line = f"{f'{1 / known.period:.0f} Hz':10}{''.join(cells)}{summary['missed']:12.2%}"
        lines.append(f"{line}  {known.scheduler}, load {known.load:.1f}")
    return "\n".join(lines)


def _measure(period: float, duration: float) -> Latency:
    """Answers another process's statuses as a drive does."""
    loop, q = _controller(period)
    v, h, D = np.zeros(len(q)), np.zeros(6), frame_motion_at_rest(loop.pose(q))
    loop.reset(q, v, h, D)
    loop.step(q, v, h, D)  # compiles the laws before anybody waits
    url = f"udpm://239.255.76.67:{20000 + os.getpid() % 30000}?ttl=0"
    processes = multiprocessing.get_context("spawn")
    ours, theirs = processes.Pipe(duplex=False)
    robot = processes.Process(target=_send, args=(url, period, duration, q, theirs), daemon=True)
    with real_time():
        named = scheduler()
        arm = LcmArm("iiwa", url, loop.joints.names, period, patience=_PATIENCE)
        robot.start()
        status = arm.connect()
        while status is not None or not ours.poll():
            if status is not None:
                arm.write(loop.step(status.q, status.v, h, D))
            elif not robot.is_alive():
                break
            status = arm.read()
    sent, micro = ours.recv() if ours.poll() else (1, np.zeros(0))
    robot.join()
    return Latency(period, micro, sent, named, os.getloadavg()[0])


def _controller(period: float) -> tuple[ControlLoop, Array]:
    plant = MultibodyPlant(1e-3)
    file = model_path("seven_joint_arm")
    robot = load_robot(file, plant, end_effector="flange", geometry="leave-out")
    plant.Finalize()
    config = ImpedanceControllerConfig()
    config.sampling.period = period
    arm, E = robot.model_instance, robot.end_effector_frame
    loop = ControlLoop(plant, arm, E, config, gravity="robot")
    return loop, find_start_posture(ControlModel.of_arm(plant, arm, E))


def _send(url: str, period: float, duration: float, q: Array, result: Connection) -> None:
    """Sends statuses at a rate; returns their number and the latencies of the answers [µs]."""
    logging.getLogger("drake").setLevel(logging.ERROR)  # the other process has warned
    heard: list[int] = []

    def take(data: bytes) -> None:
        if heard_for(data) == utime:
            heard.append(time.perf_counter_ns())

    def heard_for(data: bytes) -> int:
        answered: int = lcmt_iiwa_command.decode(data).utime
        return answered

    count, micro, utime, zeros = round(duration / period), [], 0, np.zeros(len(q))
    with real_time():
        lcm = DrakeLcm(url)
        lcm.Subscribe("IIWA_COMMAND", take)
        begun = time.perf_counter_ns()
        for k in range(1, count + 1):
            heard.clear()
            status = LCM_MESSAGES["iiwa"].write_status(RobotStatus(k * period, q, zeros, zeros))
            utime, sent = status.utime, time.perf_counter_ns()
            lcm.Publish("IIWA_STATUS", status.encode())
            until = begun + round(1e9 * k * period)
            while (left := until - time.perf_counter_ns()) > 0:
                if heard:
                    time.sleep(1e-9 * left)
                else:
                    lcm.HandleSubscriptions(max(1, left // 1_000_000))
            micro += [1e-3 * (instant - sent) for instant in heard]
    result.send((count, np.array(micro)))
