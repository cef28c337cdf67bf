"""Adds a user's own robot to a plant, and fills in what its description leaves open."""

import logging
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import overload

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, Frame, ModelInstanceIndex, WeldJoint

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError, ModelError, drake_errors
from geoimp_drake.robot_files.assembly import ArmAssembly
from geoimp_drake.robot_files.collision_filters import filter_collisions
from geoimp_drake.robot_files.description import Description
from geoimp_drake.robot_files.drive import Drive
from geoimp_drake.robot_files.geometry import GEOMETRY
from geoimp_drake.robot_files.inertia_repair import INERTIA, InertiaFault, refuse
from geoimp_drake.robot_files.messages import of_file, silent
from geoimp_drake.robot_files.packages import find_package
from geoimp_drake.robot_files.parsing import find_frame, parse, trial_plant
from geoimp_drake.robot_files.preparation import prepare
from geoimp_drake.validation import choice

__all__ = ["EndEffector", "LoadedRobot", "load_robot"]

_log = logging.getLogger("drake")

# An inertia [kg m² or kg] below this fraction of the arm's largest counts as none.
_NO_INERTIA = 1e-12


@dataclass(frozen=True)
class EndEffector:
    """Where one of several arms ends; see `load_robot` for offset and sensor joint."""

    frame: str
    offset: RigidTransform | None = None
    sensor_joint: str | None = None


@dataclass(frozen=True)
class LoadedRobot:
    """A robot in its plant.

    Attributes:
        model_instance: the robot, an arm whose every joint has an actuator; with several arms, the
            instance of this arm's joints.
        end_effector_frame: E.
        sensor_joint: the weld whose reaction force a wrist sensor reads, see `add_wrist_sensor`.
            Keep that sensor's `inertial_load: plant`: it may carry all of the last link.
        changes: the changes that were necessary, one phrase each.
    """

    model_instance: ModelInstanceIndex
    end_effector_frame: Frame
    sensor_joint: WeldJoint
    changes: tuple[str, ...]


@overload
def load_robot(
    file: str | Path,
    plant: MultibodyPlant,
    *,
    end_effector: str,
    name: str = "robot",
    offset: RigidTransform | None = None,
    sensor_joint: str | None = None,
    base_pose: RigidTransform | None = None,
    packages: Mapping[str, str | Path] | None = None,
    geometry: str = "convert",
    inertia: str = "check",
    cache: Path | None = None,
) -> LoadedRobot: ...


@overload
def load_robot(
    file: str | Path,
    plant: MultibodyPlant,
    *,
    end_effectors: Sequence[str | EndEffector],
    name: str = "robot",
    base_pose: RigidTransform | None = None,
    packages: Mapping[str, str | Path] | None = None,
    geometry: str = "convert",
    inertia: str = "check",
    cache: Path | None = None,
) -> tuple[LoadedRobot, ...]: ...


def load_robot(
    file: str | Path,
    plant: MultibodyPlant,
    *,
    end_effector: str | None = None,
    end_effectors: Sequence[str | EndEffector] = (),
    name: str = "robot",
    offset: RigidTransform | None = None,
    sensor_joint: str | None = None,
    base_pose: RigidTransform | None = None,
    packages: Mapping[str, str | Path] | None = None,
    geometry: str = "convert",
    inertia: str = "check",
    cache: Path | None = None,
) -> LoadedRobot | tuple[LoadedRobot, ...]:
    """Adds a robot from a URDF, SDF or MJCF file to a plant, ready for `make_impedance_controller`.

    It fills in what ROS-style files leave open. Joints between base and end effector get actuators
    with the file's effort limits; others (a gripper's, mimic joints) are locked. It converts meshes
    that Drake does not read. URDF links that move without any mass get an inertia from their
    shapes. The base is welded to the world. One line in Drake's log lists these changes. If the
    robot cannot be used, the plant is left as it was.

    For a robot with several arms give `end_effectors`, one for each arm. Each arm gets a model
    instance of its own, NAME_FRAME, with the joints that move it. All bodies are in the instance
    NAME. Joints that move several arms, such as those of a torso, are locked.

    Args:
        file: the description; expand a xacro file first.
        plant: not finalized, still without the user's constraints and force elements.
        end_effector: a link or frame of the file, or an MJCF site.
        end_effectors: one such frame for each arm, instead; `EndEffector` for more than its name.
        name: of the model instance.
        offset: X_FE, the pose of E in that frame F; they are the same by default.
        sensor_joint: a fixed joint between the last moving link and E. The default is the first
            one. Without any, the last moving link is cut off its joint and welded to it. The sensor
            measures whatever touches the links beyond it.
        base_pose: X_WB, of the robot's root (or of the file's world); identity by default.
        packages: folders of `package://` names; others are searched above and beside the file and
            in ROS_PACKAGE_PATH.
        geometry: `convert` meshes that Drake does not read, or do so without collision, so that the
            robot touches nothing (`visual`). Or `keep` meshes as they are, or `leave-out` all
            shapes. Links whose inertia follows from shapes keep it.
        inertia: what to do with inertias in the file that no body can have. The nearest possible
            one replaces them if the link does not move with the arm, or if they are off by 1 % at
            most. `check` refuses the others, `repair` replaces them, too.
        cache: folder for converted meshes; one of the user's by default.

    Returns:
        The robot in its plant; with `end_effectors`, one for each arm.

    Raises:
        ConfigurationError: a file, mesh or package is missing or cannot be read, a choice is
            unknown, or not one of `end_effector` and `end_effectors` is given.
        ModelError: there is no such frame or joint, an inertia is impossible, the arm has fewer
            than six joints, or a joint carries no inertia. Or the plant cannot take a robot.
    """
    file = Path(file)
    choice(geometry, "geometry", GEOMETRY)
    choice(inertia, "inertia", INERTIA)
    hands = _end_effectors(end_effector, end_effectors, offset, sensor_joint)
    arms = {hand.frame: f"{name}_{hand.frame}" for hand in hands} if end_effectors else {}
    for instance in (name, *arms.values()):
        _check_plant(plant, instance)
    with drake_errors(ModelError, f"Drake cannot use {file}"), of_file(file):
        folders = {p: find_package(p, file, packages or {}) for p in packages or {}}
        description, drives, followers, faults = prepare(file, folders, geometry, cache)
        recipe = _Recipe(
            description,
            drives,
            name,
            hands,
            arms,
            base_pose or RigidTransform(),
            folders,
        )
        with silent():
            parted = _check(recipe, followers, () if inertia == "repair" else faults)
        if plant.get_adjacent_bodies_collision_filters():
            filter_collisions(description, parted)
        robots, _ = recipe.add_to(plant)
    done = "; ".join(robots[0].changes) or "nothing had to be changed"
    _log.info(f"Robot '{name}' from {file.name}: {done}.")
    return robots if end_effectors else robots[0]


def _end_effectors(
    one: str | None,
    several: Sequence[str | EndEffector],
    offset: RigidTransform | None,
    sensor_joint: str | None,
) -> list[EndEffector]:
    if (one is None) != bool(several):
        raise ConfigurationError(
            f"end_effector is {one!r} and end_effectors is {several!r}; give the frame of the one "
            f"arm, or a list with one for each arm."
        )
    if one is not None:
        return [EndEffector(one, offset, sensor_joint)]
    if offset is not None or sensor_joint is not None:
        raise ConfigurationError(
            "offset and sensor_joint are those of one arm; for several give "
            "EndEffector(frame, offset, sensor_joint) in end_effectors."
        )
    return [EndEffector(E) if isinstance(E, str) else E for E in several]


@dataclass(frozen=True)
class _Recipe:
    """The robot to be added to a plant: first to a trial plant, then to the user's."""

    description: Description
    drives: Mapping[str, Drive]
    name: str
    end_effectors: Sequence[EndEffector]
    arms: Mapping[str, str]  # model instances by end effector, if arms get their own
    X_WB: RigidTransform
    packages: Mapping[str, Path]

    def add_to(self, plant: MultibodyPlant) -> tuple[tuple[LoadedRobot, ...], list[ArmAssembly]]:
        instance = parse(self.description, plant, self.packages)
        plant.RenameModelInstance(instance, self.name)
        frames = [self._frame(plant, instance, hand) for hand in self.end_effectors]
        instances = [instance]
        arms = [ArmAssembly(plant, instances, E) for E in frames]
        first, *others = arms
        first.place_base(self.X_WB)
        for arm in others:
            arm.weld_base(self.X_WB)
        first.lock_others(others)
        placed = []
        for hand, arm in zip(self.end_effectors, arms, strict=True):
            sensor, own = arm.sensor_joint(self.description.called(hand.sensor_joint)), instance
            if self.arms:
                own = arm.split_off(self.arms[hand.frame])
            arm.add_actuators(self.drives)
            placed.append((own, sensor))
        changes = (*self.description.changes, *(done for arm in arms for done in arm.changes))
        robots = [
            LoadedRobot(own, E, sensor, changes)
            for (own, sensor), E in zip(placed, frames, strict=True)
        ]
        return tuple(robots), arms

    def _frame(
        self, plant: MultibodyPlant, instance: ModelInstanceIndex, hand: EndEffector
    ) -> Frame:
        F = find_frame(self.description, plant, instance, hand.frame)
        if hand.offset is None or hand.offset.IsExactlyIdentity():
            return F
        return plant.AddFrame(FixedOffsetFrame(f"{F.name()}_E", F, hand.offset, instance))


def _check_plant(plant: MultibodyPlant, name: str) -> None:
    if plant.is_finalized():
        raise ModelError("The plant is finalized; load robots before plant.Finalize().")
    if plant.HasModelInstanceNamed(name):
        raise ModelError(f"The plant has a model instance '{name}' already; give another name.")
    if plant.num_constraints() or plant.num_force_elements() > 1:
        raise ModelError(
            f"The plant has {plant.num_constraints()} constraints and "
            f"{plant.num_force_elements() - 1} force elements beside gravity; load robots before "
            f"adding any (Drake changes no joints after that)."
        )


def _check(
    recipe: _Recipe, followers: set[str], faults: Iterable[InertiaFault]
) -> list[tuple[str, str]]:
    """Raises an error if the robot cannot be used, before the user's plant is touched.

    Returns the former neighbours, see `ArmAssembly.parted`.
    """
    plant, _scene_graph = trial_plant()
    robots, assemblies = recipe.add_to(plant)
    refuse(faults, set().union(*(arm.moved_links() for arm in assemblies)))
    plant.Finalize()
    for robot, hand in zip(robots, recipe.end_effectors, strict=True):
        model = ControlModel.of_arm(plant, robot.model_instance, robot.end_effector_frame)
        for joint in model.joint_names:
            if joint in followers:
                raise ModelError(
                    f"Joint '{joint}' of {recipe.description.file.name} is on the way to "
                    f"'{hand.frame}' but follows another joint (mimic); an arm's joints move "
                    f"freely. Choose a frame before it, or take the coupling out of the file."
                )
        _check_carried(model, recipe)
    return assemblies[0].parted()


def _check_carried(model: ControlModel, recipe: _Recipe) -> None:
    """Raises ModelError if the arm has no inertia at a joint: nothing bounds its acceleration."""
    M = model.plant.CalcMassMatrix(model.plant.CreateDefaultContext())
    inertias = np.diag(M)
    for k in np.flatnonzero(inertias <= _NO_INERTIA * max(inertias.max(), 1e-300)):
        joint = model.plant.GetJointByName(model.joint_names[k])
        raise ModelError(
            f"Joint '{joint.name()}' of {recipe.description.file.name} carries no inertia: link "
            f"'{joint.child_body().name()}' and what is beyond it have mass or inertia zero. Give "
            f"the link an inertia in the file (or shapes, from which it is estimated)."
        )
