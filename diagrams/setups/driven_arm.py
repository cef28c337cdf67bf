"""The arm of a scenario behind its own interface, instead of the scenario's plant.

```
 robot: real, or the scenario's plant ──status──▶ Drive: controller, supervisor ──command──▶ robot
```

A command consists of torques. With the scheme admittance it consists of joint positions, and a
simulated robot has servos.
"""

from dataclasses import replace

import numpy as np
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import StateInterpolatorWithDiscreteDerivative

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.admittance_controller import AdmittanceLoop
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.controllers.safety import refuse_safety
from geoimp_drake.controllers.wrist_sensor import add_wrist_sensor
from geoimp_drake.diagrams.setups.posture import start_posture
from geoimp_drake.diagrams.setups.single_arm import add_single_arm
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.wrist_sensor_config import ToolLoad
from geoimp_drake.robots.drive import Drive, command_of
from geoimp_drake.robots.drive_log import DriveLog
from geoimp_drake.robots.driver_config import DriverConfig
from geoimp_drake.robots.plant_arm import PlantArm
from geoimp_drake.robots.robot_arm import RobotArm, RobotStatus
from geoimp_drake.robots.tare_drive import PostureTour
from geoimp_drake.systems.arm.industrial_controller import make_industrial_controller
from geoimp_drake.systems.sources.desired_motion import DesiredMotion
from geoimp_drake.systems.sources.external_wrench import ExternalWrench
from geoimp_drake.task_functions.task_function import TaskFunction
from geoimp_drake.typing import Array
from geoimp_drake.validation import check

__all__ = ["ScenarioDrive", "simulated_robot"]


def simulated_robot(
    scenario: SingleArmScenario, gravity: str = "controller", tool: ToolLoad | None = None
) -> PlantArm:
    """Returns the plant of a scenario as a robot, at the scenario's start posture.

    Its wrist sensor gives the wrench, with the tool's inertial load removed as the plant moves.

    Args:
        scenario: its open fields are filled in.
        gravity: who compensates gravity.
        tool: the load that the sensor assumes; by default all that is beyond it.

    Raises:
        ConfigurationError: the scenario's plant is to differ from its model.
    """
    _check_nominal(scenario)
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(scenario.plant, builder)
    E, joint = add_single_arm(plant, scenario)
    arm = plant.GetModelInstanceByName(scenario.arm)
    model = ControlModel.of_arm(plant, arm, E)
    posture, X_WE = start_posture(model, scenario.start, regular=scenario.limits is None)
    plant.SetDefaultPositions(arm, model.in_plant_order(posture))
    config = replace(scenario.sensor, inertial_load="plant")
    sensor = add_wrist_sensor(builder, plant, joint, E, config, tool)
    builder.ExportOutput(sensor.GetOutputPort("wrench"), "wrench")
    if scenario.external is not None:
        source = builder.AddNamedSystem(
            "external_wrench", ExternalWrench(E, scenario.external, X_WE.rotation().matrix())
        )
        builder.Connect(source.get_output_port(), plant.get_applied_spatial_force_input_port())
    position = None
    if scenario.scheme == "admittance":
        position = _add_servos(builder, plant, arm, E, scenario)
    return PlantArm(
        builder.Build(), plant, arm, gravity=gravity, wrench="wrench", position=position
    )


def _add_servos(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    arm: ModelInstanceIndex,
    E: Frame,
    scenario: SingleArmScenario,
) -> str:
    """Adds the servos of an arm that takes positions; returns the name of their input."""
    name, n = "position", plant.num_positions(arm)
    servos = builder.AddSystem(
        make_industrial_controller(plant, arm, E, None, scenario.joint_servos())
    )
    # Only positions arrive: their velocities are differences over the period of the commands.
    differences = builder.AddNamedSystem(
        "differences", StateInterpolatorWithDiscreteDerivative(n, scenario.sampling.period, True)
    )
    builder.ExportInput(differences.get_input_port(), name)
    builder.Connect(differences.get_output_port(), servos.GetInputPort("joint_reference"))
    builder.Connect(plant.get_state_output_port(arm), servos.GetInputPort("estimated_state"))
    builder.Connect(servos.GetOutputPort("actuation"), plant.get_actuation_input_port(arm))
    return name


def _check_nominal(scenario: SingleArmScenario) -> None:
    if type(scenario) is not SingleArmScenario:
        raise ConfigurationError(
            f"experiment is '{scenario.experiment}', for a simulated plant alone, and this arm is "
            f"driven through its interface. Give another, such as custom, or use geoimp run."
        )
    if scenario.engine != "drake":
        raise ConfigurationError(
            f"engine is '{scenario.engine}', and this arm is driven through its interface. Leave "
            f"engine out, or use geoimp run."
        )
    if not scenario.world.is_none():
        raise ConfigurationError(
            "world changes the plant of a simulated run, and this arm is driven through its "
            "interface. Leave world out, or use geoimp run."
        )


class ScenarioDrive:
    """A scenario with one arm, driven through the interface that it names.

    D moves as in a run, from where the hand is when the arm is taken over.

    Args:
        scenario: is checked, and its duration filled in; the start posture is that of the robot.
        robot: the driver, instead of the one that the scenario names.
        task_function: of a redundant arm, instead of the scenario's.

    Attributes:
        robot: the driver.
        loop: the controller.

    Raises:
        ConfigurationError: the scenario cannot be used, or does not fit its driver.
    """

    def __init__(
        self,
        scenario: SingleArmScenario,
        robot: RobotArm | None = None,
        task_function: TaskFunction | None = None,
    ):
        check(scenario)
        _check_nominal(scenario)
        refuse_safety(scenario)
        self._scenario = scenario
        driver = DriverConfig() if scenario.robot is None else scenario.robot.driver
        # The joint damping of a real robot is not that of a discrete plant.
        plant = MultibodyPlant(scenario.plant.time_step if driver.kind == "plant" else 0.0)
        E, _ = add_single_arm(plant, scenario)
        arm = plant.GetModelInstanceByName(scenario.arm)
        joints = ControlModel.of_arm(plant, arm, E).joint_names
        takes = "position" if scenario.scheme == "admittance" else "torque"
        self.robot = robot or driver.make(joints, lambda: simulated_robot(scenario), takes)
        self.loop: ControlLoop | AdmittanceLoop
        if takes == "position":
            self.loop = AdmittanceLoop(plant, arm, E, scenario, joints=self.robot.joints)
        else:
            self.loop = ControlLoop(
                plant,
                arm,
                E,
                scenario,
                gravity=self.robot.gravity,
                joints=self.robot.joints,
                task_function=task_function,
            )
        scenario.duration = scenario.length
        self._drive = Drive(self.robot, self.loop, driver.drive_config(takes))

    def look(self) -> tuple[RobotStatus, Array]:
        """Returns a status and the command that would answer it; commands nothing."""
        status = self._drive.look()
        return status, command_of(self.loop.reset(status.q, status.v))

    def run(self) -> DriveLog:
        """Drives the arm; returns the log, whatever ended the drive."""
        X_WE = self.loop.pose(self._drive.look().q)
        motion = DesiredMotion(X_WE, self._scenario.segments)
        return self._drive.run(motion, self._scenario.length)

    def tour(self, tour: PostureTour) -> DriveLog:
        """Drives the arm to postures, with a rest in each; returns the log.

        Args:
            tour: its task is the one given at construction.
        """
        tour.begin(self.loop.joints.from_base(self._drive.look().q))
        return self._drive.run(tour, tour.duration)

    def log(self, driven: DriveLog) -> dict[str, Array]:
        """Returns the log of a whole drive, by the keys of a run's log."""
        rows, joints, arm = driven.whole, self.loop.joints, self._scenario.arm
        pairs = zip(rows["q"], rows["v"], strict=True)
        n, readings = len(joints.names), np.array([joints.reading(q, v) for q, v in pairs])
        own = {name: rows[name] for name in ("wrench", "motion_D", "motion_C", "motion_E")}
        own |= {"q": readings[:, :n], "v": readings[:, n:]}
        own["u"] = np.array([joints.actuation(torque) for torque in rows["torque"]])
        t = rows["t"][:, 0] - rows["t"][0, 0]
        return {"t": t} | {f"{arm}/{name}": values for name, values in own.items()}
