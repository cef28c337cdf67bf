"""An arm in a plant, driven as a robot: small enough for many short drives."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex
from pydrake.systems.framework import Diagram, DiagramBuilder

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.start_posture import find_start_posture
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.models import model_path
from geoimp_drake.robot_files.loading import load_robot
from geoimp_drake.robots.drive import Drive, DriveConfig
from geoimp_drake.robots.drive_log import DriveLog
from geoimp_drake.robots.plant_arm import PlantArm
from geoimp_drake.robots.robot_arm import RobotStatus
from geoimp_drake.systems.sources.desired_motion import DesiredMotion, MotionSegment
from geoimp_drake.systems.sources.external_wrench import ExternalWrench, WrenchRamp

LIGHT = Path(__file__).resolve().parents[1] / "robot_files" / "cases" / "light7.urdf"
STIFFNESS, PUSH = 500.0, 15.0


def make_plant(
    builder: DiagramBuilder, model: str
) -> tuple[MultibodyPlant, ModelInstanceIndex, Frame]:
    """Adds an arm of the library, in a posture away from limits, as a robot from a file."""
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    path, frame = (LIGHT, "l7") if model == "light7" else (model_path(model), "flange")
    robot = load_robot(path, plant, end_effector=frame, geometry="leave-out")
    plant.Finalize()
    arm, E = robot.model_instance, robot.end_effector_frame
    plant.SetDefaultPositions(arm, posture(model, plant, arm, E))
    return plant, arm, E


_POSTURES: dict[str, np.ndarray] = {}


def posture(model: str, plant: MultibodyPlant, arm: ModelInstanceIndex, E: Frame) -> np.ndarray:
    """Returns a start posture, searched for once."""
    if model not in _POSTURES:
        _POSTURES[model] = find_start_posture(ControlModel.of_arm(plant, arm, E))
    return _POSTURES[model]


def gains() -> ImpedanceControllerConfig:
    """Returns an impedance that bears the delay of an observer."""
    config = ImpedanceControllerConfig()
    translation, rotation = config.impedance.translation, config.impedance.rotation
    translation.mass, translation.damping = np.array(20.0), np.array(400.0)
    translation.stiffness = np.array(STIFFNESS)
    rotation.mass, rotation.damping = np.array(4.0), np.array(40.0)
    rotation.stiffness = np.array(50.0)
    return config


class DrivenArm:
    """A plant as a robot, and the controller that drives it.

    Args:
        gravity: who holds the arm's weight.
        push: by somebody on the hand, in W.
        believed: multiplies the masses that the controller believes in.
    """

    def __init__(
        self,
        model: str = "six_joint_arm",
        gravity: str = "robot",
        push: WrenchRamp | None = None,
    ):
        builder = DiagramBuilder()
        self.plant, arm, E = make_plant(builder, model)
        if push is not None:
            source = builder.AddSystem(ExternalWrench(E, push))
            port = self.plant.get_applied_spatial_force_input_port()
            builder.Connect(source.get_output_port(), port)
        self.diagram: Diagram = builder.Build()
        self.robot = PlantArm(self.diagram, self.plant, arm, gravity=gravity)
        self.loop = ControlLoop(
            self.plant, arm, E, gains(), gravity=gravity, joints=self.robot.joints
        )
        self.X_WE: RigidTransform = self.loop.pose(self.robot.connect().q)

    def motion(self, *segments: MotionSegment) -> DesiredMotion:
        """Returns a motion of D from where E is."""
        return DesiredMotion(self.X_WE, segments)

    def drive(
        self,
        duration: float,
        *segments: MotionSegment,
        config: DriveConfig | None = None,
        through: Callable[[PlantArm], Any] = lambda robot: robot,
    ) -> DriveLog:
        """Drives the arm; `through` may stand between it and its driver."""
        robot = through(self.robot)
        return Drive(robot, self.loop, config).run(self.motion(*segments), duration)


def position_scenario(*settings: str) -> Any:
    """Returns a scenario of the light arm on its own joint servos, whose hand is pushed and moved.

    Args:
        settings: KEY=VALUE, as for `--set`.
    """
    data = {
        "arm": "mine",
        "scheme": "admittance",
        "robot": {"file": str(LIGHT), "end_effector": "l7"},
        "segments": [{"duration": 0.4, "displacement": [0.0, 0.0, -0.02]}, {"duration": 4.1}],
        "external": {"force": [0.0, 0.0, PUSH], "start": 1.0, "duration": 1.0},
        "impedance": {
            "translation": {"mass": 10.0, "damping": 200.0, "stiffness": STIFFNESS},
            "rotation": {"mass": 4.0, "damping": 40.0, "stiffness": 50.0},
        },
    }
    return get_experiment("custom").scenario((data,), settings)


class Between:
    """A driver with something in its way: `disturb` sees each status and its number.

    What it returns is what the controller gets; the plant moves on all the same.
    """

    def __init__(self, robot: PlantArm, disturb: Callable[[int, RobotStatus], RobotStatus | None]):
        self._robot, self._disturb, self._count = robot, disturb, 0
        self.stopped = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._robot, name)

    def read(self) -> RobotStatus | None:
        self._count += 1
        return self._disturb(self._count, self._robot.read())

    def stop(self) -> None:
        self.stopped += 1
        self._robot.stop()
