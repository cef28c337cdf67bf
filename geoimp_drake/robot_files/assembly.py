"""From a parsed robot to an arm ready for impedance, within a plant that is not finalized.

Frames: W world, B the robot's base, P and C a joint's frames on parent and child.
"""

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    Joint,
    JointActuator,
    ModelInstanceIndex,
    RigidBody,
    SpatialInertia,
    WeldJoint,
)

from geoimp_drake.arm.control_model import TASK_DIMENSION
from geoimp_drake.errors import ModelError
from geoimp_drake.robot_files.drive import Drive
from geoimp_drake.robot_files.joints import check_single_axis, joint_between, locked_pose

__all__ = ["MOUNTING", "SENSOR_JOINT", "ArmAssembly"]

# Name of the weld that is added where the robot has none.
SENSOR_JOINT = "wrist_sensor"
# Suffix of that name for the massless body between a joint and the link that is cut off it.
MOUNTING = "_mounting"


class ArmAssembly:
    """The chain from a robot's base to its end effector, and the changes along it.

    Args:
        plant: holds the robot, not finalized.
        instances: the robot, then its arms; all arms share this list.
        E: the end effector's frame.
    """

    def __init__(self, plant: MultibodyPlant, instances: list[ModelInstanceIndex], E: Frame):
        self._plant = plant
        self._instances = instances
        self._E = E
        self._neighbours = self._joined()
        self.changes: list[str] = []

    @property
    def end_effector(self) -> str:
        """The name of E."""
        name: str = self._E.name()
        return name

    def joints(self) -> list[Joint]:
        """Returns the robot's present joints."""
        return [
            self._plant.get_joint(k)
            for instance in self._instances
            for k in self._plant.GetJointIndices(instance)
        ]

    def parted(self) -> list[tuple[str, str]]:
        """Returns the pairs of links that a joint of the file connects, but none does any more."""
        return sorted(self._neighbours - self._joined())

    def _joined(self) -> set[tuple[str, str]]:
        world = self._plant.world_body().name()
        pairs = {(j.parent_body().name(), j.child_body().name()) for j in self.joints()}
        return {pair for pair in pairs if world not in pair}

    def path(self) -> list[Joint]:
        """Returns the joints from the base to the end effector."""
        inboard = {joint.child_body().index(): joint for joint in self.joints()}
        path: list[Joint] = []
        body = self._E.body().index()
        while body in inboard and inboard[body] not in path:
            path.append(inboard[body])
            body = inboard[body].parent_body().index()
        return path[::-1]

    def moving(self) -> list[Joint]:
        """Returns the moving joints from the base to the end effector."""
        return [joint for joint in self.path() if not isinstance(joint, WeldJoint)]

    def moved_links(self) -> set[str]:
        """Returns the names of the links on the chain that move."""
        path = self.path()
        first = next((k for k, j in enumerate(path) if not isinstance(j, WeldJoint)), len(path))
        return {joint.child_body().name() for joint in path[first:]}

    def place_base(self, X_WB: RigidTransform) -> None:
        """Welds the base to the world; everything that the file welds there moves along with it."""
        world = self._plant.world_body()
        on_world = [j for j in self.joints() if j.parent_body().index() == world.index()]
        for joint in on_world:
            P = joint.frame_on_parent()
            if not X_WB.IsExactlyIdentity():
                X_WP = X_WB @ P.GetFixedPoseInBodyFrame()
                self._replace(joint, self._frame(f"{joint.name()}_base", world, X_WP))
        self.weld_base(X_WB)

    def weld_base(self, X_WB: RigidTransform) -> None:
        """Welds the base to the world unless it is welded already."""
        world, path = self._plant.world_body(), self.path()
        base = path[0].parent_body() if path else self._E.body()
        if base.index() != world.index():
            self._plant.WeldFrames(self._plant.world_frame(), base.body_frame(), X_WB)

    def lock_others(self, arms: "Sequence[ArmAssembly]" = ()) -> None:
        """Turns the moving joints that belong to no arm's chain, or to several, into welds.

        Args:
            arms: the robot's other arms.

        Raises:
            ModelError: that leaves an arm fewer than six joints.
        """
        ways = Counter(joint.index() for arm in (self, *arms) for joint in arm.path())
        moving = [joint for joint in self.joints() if not isinstance(joint, WeldJoint)]
        shared = [joint for joint in moving if ways[joint.index()] > 1]
        if shared:
            _check_left(shared, [self, *arms])
        beside = [joint for joint in moving if ways[joint.index()] == 0]
        for joints, which in ((beside, "beside the arm"), (shared, "that move several arms")):
            # A joint that is locked away from zero is reported with its position.
            done = [f"{joint.name()}{self._lock(joint)}" for joint in joints]
            if done:
                self.changes.append(f"joints {which} locked: {', '.join(done)}")

    def _lock(self, joint: Joint) -> str:
        """Welds a joint at its default position; returns a word on where that is."""
        X_PC, where = locked_pose(joint)
        weld = WeldJoint(joint.name(), joint.frame_on_parent(), joint.frame_on_child(), X_PC)
        self._remove(joint)
        self._plant.AddJoint(weld)
        return where

    def split_off(self, name: str) -> ModelInstanceIndex:
        """Puts the joints that move E into a model instance of their own; the bodies stay.

        Drake orders states and torques by the joints' model instance, which is that of the frame on
        the child.
        """
        arm = self._plant.AddModelInstance(name)
        for joint in self.moving():
            C = joint.frame_on_child()
            X_BC = C.GetFixedPoseInBodyFrame()
            own = self._frame(f"{joint.name()}_moved", joint.child_body(), X_BC, arm)
            self._replace(joint, joint.frame_on_parent(), own)
        self._instances.append(arm)
        return arm

    def sensor_joint(self, name: str | None) -> WeldJoint:
        """Returns the weld that carries the wrist sensor.

        By default it is the first one beyond the last moving link. Where there is none, the last
        moving link is cut off its joint and welded to it.

        Raises:
            ModelError: there is no such weld between the last moving link and the end effector.
        """
        path = self.path()
        last = max((k for k, j in enumerate(path) if not isinstance(j, WeldJoint)), default=-1)
        if last < 0:
            raise ModelError(
                f"No joint moves frame '{self._E.name()}'; six-DOF impedance needs six that do."
            )
        welds = {joint.name(): joint for joint in path[last + 1 :]}
        if name is not None:
            if name not in welds:
                raise ModelError(
                    f"'{name}' is not a fixed joint between the last moving link and frame "
                    f"'{self._E.name()}'. Valid: {', '.join(welds) or 'none'}. Leave the sensor "
                    "joint out, and one is added."
                )
            return welds[name]
        if welds:
            first = next(iter(welds.values()))
            self.changes.append(f"wrist sensor at fixed joint {first.name()}")
            return first
        return self._cut(path[last])

    def add_actuators(self, drives: Mapping[str, Drive]) -> None:
        """Gives every moving joint of the chain one actuator that takes a torque.

        Args:
            drives: by joint; a joint without one gets an actuator without limit and inertia.
        """
        for joint in self.moving():
            check_single_axis(joint)
        known = {joint.name(): drives.get(joint.name(), Drive()) for joint in self.moving()}
        for joint in self.moving():
            self._actuate(joint, known[joint.name()])
        self._say("actuators added", [j for j, d in known.items() if d.actuator is None])
        servos = [j for j, d in known.items() if d.is_servo]
        several = [j for j, d in known.items() if d.has_several]
        unlimited = [j for j, d in known.items() if not np.isfinite(d.effort_limit)]
        self._say("servos replaced by torque actuators", servos)
        self._say("smallest limit of several actuators taken", several)
        self._say("no effort limit known", unlimited)
        for what, part in (("dry friction", "friction"), ("springs", "stiffness")):
            lost = {joint: getattr(drive, part) for joint, drive in known.items()}
            self._say(f"{what} left out", [f"{joint} {x:g}" for joint, x in lost.items() if x])

    def _say(self, what: str, joints: list[str]) -> None:
        if joints:
            self.changes.append(f"{what}: {', '.join(joints)}")

    def _actuate(self, joint: Joint, drive: Drive) -> None:
        if (old := self._actuator(joint)) is not None:
            self._plant.RemoveJointActuator(old)
        name = drive.actuator or joint.name()
        if self._plant.HasJointActuatorNamed(name, joint.model_instance()):
            name = joint.name()
        actuator = self._plant.AddJointActuator(name, joint, drive.effort_limit)
        actuator.set_default_rotor_inertia(drive.rotor_inertia)
        actuator.set_default_gear_ratio(drive.gear_ratio)

    def _cut(self, joint: Joint) -> WeldJoint:
        """Puts a massless mounting between a joint and its link; returns the weld between them."""
        link, robot = joint.child_body(), self._instances[0]
        name = SENSOR_JOINT
        if self._plant.HasJointNamed(name, robot):
            name = f"{SENSOR_JOINT}_{joint.name()}"
        mounting = self._plant.AddRigidBody(f"{name}{MOUNTING}", robot, SpatialInertia.Zero())
        X_LC = joint.frame_on_child().GetFixedPoseInBodyFrame()
        C = self._frame(f"{name}_{joint.name()}", mounting, X_LC)
        self.changes.append(f"wrist sensor put between joint {joint.name()} and link {link.name()}")
        self._replace(joint, joint.frame_on_parent(), C)
        weld = WeldJoint(name, mounting.body_frame(), link.body_frame(), RigidTransform.Identity())
        return self._plant.AddJoint(weld)

    def _replace(self, joint: Joint, P: Frame, C: Frame | None = None) -> None:
        """Attaches a joint to other frames; its actuator goes."""
        copy = joint_between(joint, P, C or joint.frame_on_child())
        self._remove(joint)
        self._plant.AddJoint(copy)

    def _remove(self, joint: Joint) -> None:
        """Deletes a joint and its actuator; do not use Python's references to them any more."""
        if (actuator := self._actuator(joint)) is not None:
            self._plant.RemoveJointActuator(actuator)
        self._plant.RemoveJoint(joint)

    def _actuator(self, joint: Joint) -> JointActuator | None:
        # Drake knows the actuators of one model instance only once the plant is finalized.
        for index in self._plant.GetJointActuatorIndices():
            actuator = self._plant.get_joint_actuator(index)
            if actuator.joint().index() == joint.index():
                return actuator
        return None

    def _frame(
        self,
        name: str,
        body: RigidBody,
        X_BF: RigidTransform,
        instance: ModelInstanceIndex | None = None,
    ) -> Frame:
        owner = self._instances[0] if instance is None else instance
        return self._plant.AddFrame(FixedOffsetFrame(name, body.body_frame(), X_BF, owner))


def _check_left(shared: list[Joint], arms: "Sequence[ArmAssembly]") -> None:
    """Raises ModelError if an arm has too few joints that move no other arm."""
    locked = {joint.index() for joint in shared}
    for arm in arms:
        left = [joint.name() for joint in arm.moving() if joint.index() not in locked]
        if len(left) < TASK_DIMENSION:
            raise ModelError(
                f"{len(left)} joints ({', '.join(left) or 'none'}) move end effector "
                f"'{arm.end_effector}' and no other; six-DOF impedance needs {TASK_DIMENSION}. "
                f"Shared are: {', '.join(joint.name() for joint in shared)}. Give one end effector "
                f"for each arm, in end_effectors."
            )
