"""Finds the load on the arm of a scenario beyond its robot's file, in one of three ways.

The arm is moved by hand or driven to postures and read at rest, or a motion of it was logged.
"""

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.wrist_sensor import tool_load_beyond
from geoimp_drake.diagrams.setups import driven_arm
from geoimp_drake.diagrams.setups.posture import start_posture
from geoimp_drake.diagrams.setups.single_arm import add_single_arm
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.sensing.load_identification import IdentifiedLoad
from geoimp_drake.parts.wrist_sensor_config import ToolLoad
from geoimp_drake.robots.driver_config import DriverConfig
from geoimp_drake.robots.real_time import real_time
from geoimp_drake.robots.robot_arm import RobotArm
from geoimp_drake.robots.tare import identify_payload, read_at_rest, tare_postures
from geoimp_drake.robots.tare_drive import PostureTour, readings_of
from geoimp_drake.robots.tare_log import identify_from_log
from geoimp_drake.task_functions.posture import POSTURE_RATE
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, finite_array

__all__ = ["payload_driven", "payload_logged", "payload_of"]

# The number of statuses in a posture's mean.
_SAMPLES = 100

# A load, and the names of the joints from base to hand.
Found = tuple[IdentifiedLoad, tuple[str, ...]]


class _Bare(NamedTuple):
    """An arm in free space, and its model from the robot's file, without a payload.

    Attributes:
        real: the scenario without surface and push.
        model: of the arm without a payload.
        tool: load of its wrist sensor in that case.
    """

    real: SingleArmScenario
    model: ControlModel
    tool: ToolLoad


def payload_of(
    scenario: SingleArmScenario,
    count: int,
    wait: Callable[[int], None],
    *,
    at_wrist: bool = False,
) -> Found:
    """Returns the load on the arm of a scenario beyond its robot's file, and the joints' names.

    A real robot gets no commands: it is moved by hand. A simulated one is put into each posture,
    without surface and push.

    Args:
        scenario: with a robot of its own.
        count: number of postures.
        wait: gets the number of a posture, and returns when the robot rests in it.
        at_wrist: uses the wrench that the robot reports instead of its joints' torques.

    Raises:
        RobotError: the robot does not answer, moves, or reports no external torques, or no wrench.
        ConfigurationError: the postures are too alike.
    """
    real, model, tool = _bare(scenario)
    driver, readings = _driver(real), []
    if driver.kind == "plant":
        first, _ = start_posture(model, scenario.start, regular=scenario.limits is None)
        for q in tare_postures(model, first, count):
            start = replace(scenario.start, posture=q.tolist())
            robot: RobotArm = driven_arm.simulated_robot(replace(real, start=start), tool=tool)
            robot.connect()
            readings.append(read_at_rest(robot, model, _SAMPLES, at_wrist=at_wrist))
    else:
        robot = driver.make(model.joint_names, lambda: driven_arm.simulated_robot(real))
        for number in range(1, count + 1):
            wait(number)
            robot.connect()
            readings.append(read_at_rest(robot, model, _SAMPLES, at_wrist=at_wrist))
    return identify_payload(robot, model, readings, at_wrist=at_wrist), model.joint_names


def payload_driven(
    scenario: SingleArmScenario, postures: Array, *, at_wrist: bool = False
) -> Found:
    """Returns the same for an arm that is driven to postures, and rests in each.

    All joints move at once, and D is the hand's pose at their desired positions. No wrench is used
    meanwhile, so neither load nor bias moves C away from D. For the same reason the arm does not
    yield to obstacles. The controller assumes the scenario's payload, which need not be right.

    Args:
        scenario: with a robot of its own.
        postures: joint positions (m, n), from base to hand.
        at_wrist: uses the wrench that the robot reports instead of its joints' torques.

    Raises:
        RobotError: the robot does not answer, is stopped before the last posture, or reports no
            external torques, or no wrench.
        ConfigurationError: the postures are not within the joints' limits, or too alike.
    """
    real, model, tool = _bare(scenario)
    driver = _driver(real)
    _check_postures(postures, model)
    assert real.robot is not None
    blind = replace(driver, wrench="none", wrench_bias=np.zeros(6))
    # Whatever the scenario's task, a redundant arm keeps to the tour's postures.
    held = replace(real.redundancy, task=None, k_beta=-POSTURE_RATE)
    driven = replace(real, robot=replace(real.robot, driver=blind), redundancy=held)
    is_simulated = driver.kind == "plant"
    robot = driven_arm.simulated_robot(real, tool=tool) if is_simulated else None
    with nullcontext() if is_simulated else real_time():
        tour = PostureTour(model, list(postures))
        drive = driven_arm.ScenarioDrive(driven, robot, tour.task)
        log = drive.tour(tour)
    readings = readings_of(log, len(postures), drive.robot, model, at_wrist=at_wrist)
    return identify_payload(drive.robot, model, readings, at_wrist=at_wrist), model.joint_names


def payload_logged(
    scenario: SingleArmScenario, log: dict[str, Array], *, at_wrist: bool = False
) -> Found:
    """Returns the same from a logged motion of the arm, with the load's inertia.

    Args:
        scenario: with a robot of its own.
        log: arrays of a run or a drive, by key.
        at_wrist: uses the logged wrench instead of the torques.

    Raises:
        ConfigurationError: the log is not of this arm, or its motion does not show a load.
    """
    real, model, _ = _bare(scenario)
    gravity = "controller" if _driver(real).kind == "plant" else "robot"
    load = identify_from_log(log, scenario.arm, model, gravity=gravity, at_wrist=at_wrist)
    return load, model.joint_names


def _bare(scenario: SingleArmScenario) -> _Bare:
    check(scenario)
    assert scenario.robot is not None
    real = replace(scenario, surface=None, external=None)
    known, plant = replace(scenario.robot, payload=None), MultibodyPlant(0.0)
    E, joint = add_single_arm(plant, replace(real, robot=known))
    model = ControlModel.of_arm(plant, plant.GetModelInstanceByName(scenario.arm), E)
    return _Bare(real, model, tool_load_beyond(plant, joint))


def _driver(scenario: SingleArmScenario) -> DriverConfig:
    assert scenario.robot is not None
    return scenario.robot.driver


def _check_postures(postures: Array, model: ControlModel) -> None:
    finite_array(postures, "The list of postures", (len(postures), model.num_joints))
    low, high = model.position_limits
    for number, q in enumerate(postures, 1):
        outside = np.flatnonzero((q < low) | (q > high))
        if len(outside):
            k = outside[0]
            raise ConfigurationError(
                f"Posture {number} has {model.joint_names[k]} at {q[k]:g}; its limits are "
                f"{low[k]:g} and {high[k]:g}."
            )
