"""The commands `geoimp drive` and `geoimp robot-sim`."""

from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np

from geoimp_drake.diagrams.setups.driven_arm import ScenarioDrive, simulated_robot
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.output_folder import check_folder, write_files
from geoimp_drake.robots.lcm_arm import LcmRobot
from geoimp_drake.robots.real_time import real_time
from geoimp_drake.robots.robot_arm import RobotError
from geoimp_drake.simulation.claims import format_claims
from geoimp_drake.simulation.experiment import RUN_FILES, as_npz, write_run

__all__ = ["drive_robot", "look_at_robot", "simulate_robot", "single"]

_TICKS = "ticks.npz"


def drive_robot(
    experiment: Any, scenario: Any, out: Path, *, figures: bool, html: bool = False
) -> tuple[str, list[Path], Exception | None]:
    """Drives the robot of a scenario; returns claims, files and the error that ended it early.

    Args:
        experiment: from the catalogue.
        scenario: for it.
        out: folder to write into; made if need be.
        figures: draw the experiment's figures.
        html: write a replay.
    """
    check_folder(out, [*RUN_FILES, _TICKS])
    is_simulated = single(scenario).robot.driver.kind == "plant"
    with nullcontext() if is_simulated else real_time():
        drive = ScenarioDrive(scenario)
        log = drive.run()
    # Write these first: no later failure can lose them.
    ticks = write_files(out, [(_TICKS, as_npz(log.values))])
    if not len(log.whole["t"]):
        raise RobotError(
            f"{drive.robot.name}: nothing was driven, and nothing sent: "
            f"{log.failure or 'no status came.'}"
        )
    rows = drive.log(log)
    replay = experiment.replay(scenario, rows) if html else None
    failure = log.failure or log.early
    result = write_run(experiment, scenario, rows, failure, out, figures, replay)
    computing = f"{1e6 * np.median(log.computing):.0f} µs in the median"
    said = f"{log.ticks} ticks of {1e3 * drive.robot.period:g} ms, computed in {computing}"
    return f"{said}\n{format_claims(result.claims)}", [*result.files, *ticks], failure


def look_at_robot(scenario: Any) -> None:
    """Prints where a robot is and what it would be sent; commands nothing."""
    drive = ScenarioDrive(single(scenario))
    status, command = drive.look()
    X_WE = drive.loop.pose(status.q)
    print(f"{drive.robot.name}: gravity is held by the {drive.robot.gravity}")
    print(f"E at {np.round(X_WE.translation(), 4).tolist()} m in W")
    limits = [f" of ±{limit:g}" for limit in drive.loop.joints.effort_limits]
    if (takes := drive.robot.takes) == "position":
        limits = [""] * len(limits)
    rows = zip(drive.robot.joints, status.q, status.v, command, limits, strict=True)
    for joint, q, v, sent, limit in rows:
        print(f"{joint:24} q {q:8.4f}  v {v:8.4f}  {takes} {sent:9.3f}{limit}")


def simulate_robot(scenario: Any, url: str, *, in_step: bool) -> None:
    """Lets the arm of a scenario speak Drake's messages for the scenario's duration.

    Args:
        scenario: with one arm.
        url: of LCM; empty for its own default.
        in_step: wait for the answer to each status.
    """
    driver = single(scenario).robot.driver
    robot = simulated_robot(scenario, gravity="robot")
    server = LcmRobot(robot, driver.messages, url or driver.url, driver.period, driver.channel)
    print(f"A status each {1e3 * driver.period:g} ms as an {driver.messages} sends it.", flush=True)
    server.run(scenario.length, in_step=in_step)


def single(scenario: Any) -> Any:
    """Returns a scenario with a robot of its own; raises ConfigurationError for another."""
    if not isinstance(scenario, SingleArmScenario) or scenario.robot is None:
        raise ConfigurationError(
            "The scenario has no robot of its own; give robot.file, robot.end_effector and "
            "robot.driver (`geoimp init --robot FILE` writes the first two)."
        )
    return scenario
