"""A robot of the user's own in a scenario's YAML."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, RotationalInertia, SpatialInertia

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.robot_files.geometry import GEOMETRY
from geoimp_drake.robot_files.inertia_repair import INERTIA
from geoimp_drake.robot_files.loading import LoadedRobot, load_robot
from geoimp_drake.robots.driver_config import DriverConfig
from geoimp_drake.rotations import euler
from geoimp_drake.typing import Array
from geoimp_drake.validation import (
    PATH,
    check,
    choice,
    finite_vector,
    key,
    non_negative,
    positive,
    unknown_name,
)

__all__ = ["PayloadConfig", "RobotConfig"]

_POSES = ("offset_position", "offset_attitude_deg", "base_position", "base_attitude_deg")


@dataclass
class PayloadConfig:
    """A load on the end effector that is not in the robot's file; `geoimp tare` finds it."""

    mass: float = 1.0  # [kg]
    centre_of_mass: Array = field(default_factory=lambda: np.zeros(3))  # in E [m]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        positive(self.mass, key(name, "mass"), "kg")
        finite_vector(self.centre_of_mass, key(name, "centre_of_mass"), 3)

    def add(self, plant: MultibodyPlant, E: Frame) -> None:
        """Welds a point mass to E, in the model instance of E's body."""
        point = RotationalInertia(0.0, 0.0, 0.0)
        inertia = SpatialInertia.MakeFromCentralInertia(self.mass, self.centre_of_mass, point)
        body = plant.AddRigidBody("payload", E.body().model_instance(), inertia)
        plant.WeldFrames(E, body.body_frame())


@dataclass
class RobotConfig:
    """A robot from a file; attitudes are XYZ Euler angles."""

    file: str = field(default="", metadata=PATH)  # URDF, SDF or MJCF
    end_effector: str = ""  # its link, frame or site F
    offset_position: Array = field(default_factory=lambda: np.zeros(3))  # of E in F [m]
    offset_attitude_deg: Array = field(default_factory=lambda: np.zeros(3))
    sensor_joint: str | None = None  # a fixed joint; null: one is found or added
    # Folders of package:// names.
    packages: dict[str, str] = field(default_factory=dict, metadata=PATH)
    geometry: str = "visual"  # no collision; with collision: convert, keep; or leave-out
    inertia: str = "check"  # or repair: impossible inertias on the arm's chain
    base_position: Array = field(default_factory=lambda: np.zeros(3))  # in W [m]
    base_attitude_deg: Array = field(default_factory=lambda: np.zeros(3))
    # Of motors at their joints, by joint name; replaces the file's [kg m² or kg].
    rotor_inertia: dict[str, float] = field(default_factory=dict)
    payload: PayloadConfig | None = None  # on E, not in the file
    driver: DriverConfig = field(default_factory=DriverConfig)  # for `geoimp drive`

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it.

        `load` checks the contents of the file.
        """
        for part, what in (
            ("file", "a URDF, SDF or MJCF file"),
            ("end_effector", "a link's name"),
        ):
            if not getattr(self, part):
                raise ConfigurationError(f"{key(name, part)} is empty; give {what}.")
        choice(self.geometry, key(name, "geometry"), GEOMETRY)
        choice(self.inertia, key(name, "inertia"), INERTIA)
        for part in _POSES:
            finite_vector(getattr(self, part), key(name, part), 3)
        for joint, inertia in self.rotor_inertia.items():
            non_negative(inertia, key(name, f"rotor_inertia.{joint}"))

    def load(
        self, plant: MultibodyPlant, name: str = "robot", folder: Path | None = None
    ) -> LoadedRobot:
        """Adds the robot to a plant, see `load_robot`.

        Args:
            plant: not finalized.
            name: of the model instance.
            folder: where relative paths start, that of the YAML file; the current one by default.

        Raises:
            ConfigurationError: as `validate` and `load_robot`.
            ModelError: as `load_robot`.
        """
        check(self, "robot")
        start = folder or Path()
        robot = load_robot(
            start / Path(self.file).expanduser(),
            plant,
            end_effector=self.end_effector,
            name=name,
            offset=_pose(self.offset_position, self.offset_attitude_deg),
            sensor_joint=self.sensor_joint,
            base_pose=_pose(self.base_position, self.base_attitude_deg),
            packages={key: start / Path(p).expanduser() for key, p in self.packages.items()},
            geometry=self.geometry,
            inertia=self.inertia,
        )
        _set_rotors(plant, robot, self.rotor_inertia)
        if self.payload is not None:
            self.payload.add(plant, robot.end_effector_frame)
        return robot


def _set_rotors(plant: MultibodyPlant, robot: LoadedRobot, inertias: Mapping[str, float]) -> None:
    """Gives actuators the inertia of their motors at the joint."""
    actuators = map(plant.get_joint_actuator, plant.GetJointActuatorIndices())
    own = {
        actuator.joint().name(): actuator
        for actuator in actuators
        if actuator.joint().model_instance() == robot.model_instance
    }
    for joint, inertia in inertias.items():
        if joint not in own:
            raise unknown_name(joint, "joint in robot.rotor_inertia", own)
        own[joint].set_default_gear_ratio(1.0)
        own[joint].set_default_rotor_inertia(inertia)


def _pose(position: Array, attitude_deg: Array) -> RigidTransform:
    R = euler.to_rotation(np.deg2rad(np.asarray(attitude_deg, dtype=float)))
    return RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), position)
