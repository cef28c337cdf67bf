"""From a parsed robot to an arm ready for impedance, within a plant that is not finalized.

Frames: W world, B the robot's base, P and C a joint's frames on parent and child.
"""

from collections.abc import Mapping

import numpy as np
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    Joint,
    JointActuator,
    ModelInstanceIndex,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SpatialInertia,
    WeldJoint,
)

from geoimp_drake.errors import ModelError
from geoimp_drake.robot_files.drive import Drive

__all__ = ["SENSOR_JOINT", "ArmAssembly"]

# Name of the weld that is put where the robot has none.
SENSOR_JOINT = "wrist_sensor"


class ArmAssembly:
    """The way from a robot's base to its end effector, and what is changed along it.

    Args:
        plant: holds the robot, not finalized.
        instance: the robot.
        E: the end effector's frame.
    """

    def __init__(self, plant: MultibodyPlant, instance: ModelInstanceIndex, E: Frame):
        self._plant = plant
        self._instance = instance
        self._E = E
        self._neighbours = self._joined()
        self.changes: list[str] = []

    def joints(self) -> list[Joint]:
        """Returns the robot's joints, whichever there are now."""
        return [self._plant.get_joint(k) for k in self._plant.GetJointIndices(self._instance)]

    def parted(self) -> list[tuple[str, str]]:
        """Returns the links, in pairs, that a joint of the file connects and none does any more."""
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

    def place_base(self, X_WB: RigidTransform) -> None:
        """Welds the base to the world; what the file welds there is moved along with it."""
        world = self._plant.world_body()
        on_world = [j for j in self.joints() if j.parent_body().index() == world.index()]
        for joint in on_world:
            P = joint.frame_on_parent()
            if not X_WB.IsExactlyIdentity():
                X_WP = X_WB @ P.GetFixedPoseInBodyFrame()
                self._replace(joint, self._frame(f"{joint.name()}_base", world, X_WP))
        path = self.path()
        base = path[0].parent_body() if path else self._E.body()
        if base.index() != world.index():
            self._plant.WeldFrames(self._plant.world_frame(), base.body_frame(), X_WB)

    def lock_others(self) -> None:
        """Turns the moving joints that are not on the way, a gripper's, into welds."""
        on_path = {joint.index() for joint in self.path()}
        others = [
            joint
            for joint in self.joints()
            if joint.index() not in on_path and not isinstance(joint, WeldJoint)
        ]
        # A joint that is locked away from zero is worth a number.
        done = []
        for joint in others:
            X_PC, where = _default_pose(joint)
            done.append(f"{joint.name()}{where}")
            weld = WeldJoint(joint.name(), joint.frame_on_parent(), joint.frame_on_child(), X_PC)
            self._remove(joint)
            self._plant.AddJoint(weld)
        if done:
            self.changes.append(f"joints beside the arm locked: {', '.join(done)}")

    def sensor_joint(self, name: str | None) -> WeldJoint:
        """Returns the weld that carries the wrist sensor.

        By default the first one beyond the last moving link; where there is none, the last moving
        link is cut off its joint and welded to it.

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
                    f"'{name}' is no fixed joint between the last moving link and frame "
                    f"'{self._E.name()}'. Valid: {', '.join(welds) or 'none'}. Give no sensor "
                    f"joint to have one put there."
                )
            return welds[name]
        if welds:
            first = next(iter(welds.values()))
            self.changes.append(f"wrist sensor at fixed joint {first.name()}")
            return first
        return self._cut(path[last])

    def add_actuators(self, drives: Mapping[str, Drive]) -> None:
        """Gives every moving joint on the way one actuator that takes a torque.

        Args:
            drives: by joint; one that is not there gets an actuator without limit and inertia.
        """
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
        if self._plant.HasJointActuatorNamed(name, self._instance):
            name = joint.name()
        actuator = self._plant.AddJointActuator(name, joint, drive.effort_limit)
        actuator.set_default_rotor_inertia(drive.rotor_inertia)
        actuator.set_default_gear_ratio(drive.gear_ratio)

    def _cut(self, joint: Joint) -> WeldJoint:
        """Puts a massless mounting between a joint and its link; returns the weld between them."""
        link = joint.child_body()
        mounting = self._plant.AddRigidBody(
            f"{SENSOR_JOINT}_mounting", self._instance, SpatialInertia.Zero()
        )
        X_LC = joint.frame_on_child().GetFixedPoseInBodyFrame()
        C = self._frame(f"{SENSOR_JOINT}_{joint.name()}", mounting, X_LC)
        self.changes.append(f"wrist sensor put between joint {joint.name()} and link {link.name()}")
        self._replace(joint, joint.frame_on_parent(), C)
        weld = WeldJoint(
            SENSOR_JOINT, mounting.body_frame(), link.body_frame(), RigidTransform.Identity()
        )
        return self._plant.AddJoint(weld)

    def _replace(self, joint: Joint, P: Frame, C: Frame | None = None) -> None:
        """Attaches a joint to other frames; its actuator goes."""
        copy = _copy(joint, P, C or joint.frame_on_child())
        self._remove(joint)
        self._plant.AddJoint(copy)

    def _remove(self, joint: Joint) -> None:
        """Deletes a joint and its actuator; what Python still holds of them must not be used."""
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

    def _frame(self, name: str, body: RigidBody, X_BF: RigidTransform) -> Frame:
        return self._plant.AddFrame(FixedOffsetFrame(name, body.body_frame(), X_BF, self._instance))


def _copy(joint: Joint, P: Frame, C: Frame) -> Joint:
    """Returns the same joint between other frames."""
    if isinstance(joint, WeldJoint):
        return WeldJoint(joint.name(), P, C, joint.X_FM())
    if not isinstance(joint, RevoluteJoint | PrismaticJoint):
        raise ModelError(
            f"Joint '{joint.name()}' is of type '{joint.type_name()}'; an arm is made of revolute "
            f"and prismatic joints."
        )
    revolute = isinstance(joint, RevoluteJoint)
    axis = joint.revolute_axis() if revolute else joint.translation_axis()
    kind = RevoluteJoint if revolute else PrismaticJoint
    copy = kind(joint.name(), P, C, axis, damping=joint.default_damping())
    copy.set_position_limits(joint.position_lower_limits(), joint.position_upper_limits())
    copy.set_velocity_limits(joint.velocity_lower_limits(), joint.velocity_upper_limits())
    copy.set_acceleration_limits(
        joint.acceleration_lower_limits(), joint.acceleration_upper_limits()
    )
    copy.set_default_positions(joint.default_positions())
    return copy


def _default_pose(joint: Joint) -> tuple[RigidTransform, str]:
    """Returns X_PC in the default position, or the nearest one allowed, and a word on which."""
    if not isinstance(joint, RevoluteJoint | PrismaticJoint):
        raise ModelError(
            f"Joint '{joint.name()}' beside the arm is of type '{joint.type_name()}', which cannot "
            f"be locked; fix it in the file."
        )
    low, high = joint.position_lower_limit(), joint.position_upper_limit()
    q = float(np.clip(joint.default_positions()[0], low, high))
    where = f" at {q:g}" if q else ""
    if isinstance(joint, PrismaticJoint):
        return RigidTransform(q * joint.translation_axis()), where
    return RigidTransform(RotationMatrix(AngleAxis(q, joint.revolute_axis()))), where
