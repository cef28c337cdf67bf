"""Two ends of LCM, each in its own process; run as a program, which prints what came of it as JSON.

In a network namespace of its own no other traffic is heard, and none is sent.
"""

import json
import logging
import multiprocessing
import os
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from typing import Any

import numpy as np
from driven_arm import DrivenArm, gains, position_scenario
from pydrake.lcm import DrakeLcm

from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.diagrams.setups.driven_arm import ScenarioDrive, simulated_robot
from geoimp_drake.laws.frame_motion import POSITION
from geoimp_drake.parts.supervisor import Mode, SupervisorConfig
from geoimp_drake.robots.drive import Drive, DriveConfig
from geoimp_drake.robots.lcm_arm import LcmArm, LcmRobot
from geoimp_drake.robots.lcm_messages import LCM_MESSAGES
from geoimp_drake.robots.robot_arm import RobotError, RobotStatus
from geoimp_drake.systems.sources.desired_motion import DesiredMotion
from geoimp_drake.systems.sources.external_wrench import WrenchRamp

PERIOD = 5e-3
PUSH = WrenchRamp(force=np.array([0.0, 0.0, 15.0]), start=0.8, duration=0.2, blend=0.05)
# A machine with other work is late at times, and so is the answer.
PATIENT = SupervisorConfig(hold=10.0)

_ISOLATED = "ip link set lo up && ip route add 224.0.0.0/4 dev lo && exec "


def in_own_network(*arguments: str) -> Any:
    """Returns what this program finds where it hears nothing else, if that can be made."""
    return json.loads(isolated(sys.executable, __file__, *arguments).splitlines()[-1])


def isolated(*command: str) -> str:
    """Returns what a command prints, in a network of its own if that can be made."""
    if _can_isolate():
        command = ("unshare", "-n", "sh", "-c", _ISOLATED + '"$@"', "sh", *command)
    ended = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


def _can_isolate() -> bool:
    if not (shutil.which("unshare") and shutil.which("ip")):
        return False
    tried = ["unshare", "-n", "sh", "-c", _ISOLATED + "true"]
    return subprocess.run(tried, capture_output=True, timeout=30, check=False).returncode == 0


def _url(process: int) -> str:
    return f"udpm://239.255.76.67:{20000 + process % 30000}?ttl=0"


def _serve(robot: str, url: str) -> None:
    """Simulates a robot, whose joints feel the push."""
    logging.getLogger("drake").setLevel(logging.ERROR)
    arm = DrivenArm("light7", push=PUSH)
    LcmRobot(arm.robot, robot, url, PERIOD).run(60.0, in_step=True)


def _driver(robot: str, url: str, patience: float) -> LcmArm:
    joints = tuple(f"j{k}" for k in range(1, 8))
    return LcmArm(robot, url, joints, PERIOD, patience=patience)


def _client(driver: LcmArm, wrench: str) -> tuple[Drive, ControlLoop]:
    arm = DrivenArm("light7")
    config = gains()
    config.sampling.period = PERIOD
    config.impedance.translation.damping = np.array(200.0)
    instance = arm.plant.GetModelInstanceByName("robot")
    E = arm.plant.GetFrameByName("l7")
    loop = ControlLoop(arm.plant, instance, E, config, gravity="robot", joints=driver.joints)
    return Drive(driver, loop, DriveConfig(wrench=wrench, supervisor=PATIENT)), loop


def push(robot: str, wrench: str) -> dict[str, Any]:
    """Returns how far the pushed hand of a driven arm is from D, and the wrench [m; Nm, N]."""
    DrivenArm("light7").drive(0.1)  # what it compiles would let the push act on an arm that is free
    url = _url(os.getpid())
    server = multiprocessing.get_context("spawn").Process(target=_serve, args=(robot, url))
    drive, loop = _client(_driver(robot, url, 5.0), wrench)
    server.start()
    try:
        log = drive.run(DesiredMotion(loop.pose(_first_status(drive).q)), 3.5)
    finally:
        server.kill()
        server.join()
    # The last row before the stop.
    k = np.flatnonzero(log.values["mode"][:, 0] == Mode.RUN)[-1]
    E, D = (log.values[f"motion_{frame}"][k, POSITION] for frame in "ED")
    return {"way": (E - D).tolist(), "wrench": log.values["wrench"][k].tolist()}


def positions() -> dict[str, Any]:
    """Returns how far the pushed hand of an iiwa that takes positions is from D [m]."""
    ScenarioDrive(position_scenario("segments=[{duration: 0.1}]")).run()  # compiles, as above
    url = _url(os.getpid())
    server = multiprocessing.get_context("spawn").Process(target=_serve_positions, args=(url,))
    scenario = _of_positions(url)
    scenario.robot.driver.supervisor = PATIENT
    drive = ScenarioDrive(scenario)
    drive.robot._patience = 5.0
    server.start()
    try:
        _first_status(drive)
        log = drive.run()
    finally:
        server.kill()
        server.join()
    rows = log.values
    k = np.flatnonzero(rows["mode"][:, 0] == Mode.RUN)[-1]
    E, D = (rows[f"motion_{frame}"][k, POSITION] for frame in "ED")
    jump = np.abs(rows["position"][0] - rows["q"][0]).max()
    return {"way": (E - D).tolist(), "jump": float(jump), "modes": np.unique(rows["mode"]).tolist()}


def _of_positions(url: str) -> Any:
    driver = f"robot.driver={{kind: lcm, url: '{url}', period: {PERIOD}}}"
    return position_scenario(driver, f"sampling.period={PERIOD}", f"servos={{period: {PERIOD}}}")


def _serve_positions(url: str) -> None:
    """Simulates an arm on its own servos, pushed later on, as its process starts first."""
    logging.getLogger("drake").setLevel(logging.ERROR)
    robot = simulated_robot(_of_positions(url), gravity="robot")
    LcmRobot(robot, "iiwa", url, PERIOD).run(60.0, in_step=True)


def _first_status(drive: Any) -> RobotStatus:
    for _ in range(50):  # of two seconds: its process takes a while to start
        try:
            return drive.look()
        except RobotError:
            continue
    raise RobotError("the simulated robot has not started")


def faults(robot: str) -> dict[str, Any]:
    """Returns what is said of a robot that is not there, of its first statuses, of another arm."""
    url = _url(os.getpid())
    driver, publisher = _driver(robot, url, 0.2), DrakeLcm(url)
    drive, _ = _client(driver, "none")

    def publish(status: RobotStatus) -> None:  # heard by the next look
        publisher.Publish(
            f"{robot.upper()}_STATUS", LCM_MESSAGES[robot].write_status(status).encode()
        )

    rest = RobotStatus(1.0, np.full(7, 0.5), np.zeros(7), np.zeros(7))
    found: dict[str, Any] = {"silent": _refusal(drive), "read": []}
    for status in (rest, replace(rest, time=0.0), RobotStatus(1.0, *np.zeros((3, 0)))):
        publish(status)
        found["read"].append(driver.read() is not None)
    publish(rest)
    time.sleep(0.1)
    driver.start()
    found["stale"] = driver.read() is not None
    publish(RobotStatus(2.0, *np.zeros((3, 6))))
    found["other"] = _refusal(drive)
    return found


def _refusal(drive: Drive) -> str:
    try:
        drive.look()
    except RobotError as error:
        return str(error)
    return ""


if __name__ == "__main__":
    logging.getLogger("drake").setLevel(logging.ERROR)
    task = {"push": push, "faults": faults, "positions": positions}[sys.argv[1]]
    print(json.dumps(task(*sys.argv[2:])))
