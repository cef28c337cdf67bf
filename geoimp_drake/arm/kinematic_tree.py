"""A plant's joints as a tree rooted in the world: which body carries which."""

from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BodyIndex,
    Frame,
    Joint,
    ModelInstanceIndex,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    WeldJoint,
)

from geoimp_drake.typing import Array

__all__ = ["Chain", "KinematicTree", "moving_joints_beyond", "path_to", "welded_bodies"]

# Joints from the base outwards, each with the body on its far side.
Chain = list[tuple[Joint, RigidBody]]


def welded_bodies(
    plant: MultibodyPlant, joint: Joint, without: Sequence[ModelInstanceIndex] = ()
) -> list[RigidBody]:
    """Returns the bodies that a weld joint carries: the far side's, and all that move with it.

    Joints further out (a gripper's fingers) count as locked. The first body is the one on the far
    side: the joint's parent if the joint was declared from the hand to the base.
    """
    tree = KinematicTree(plant, set(without))
    return tree.carried_by(tree.far_side(joint).index(), through_joints=True)


def moving_joints_beyond(plant: MultibodyPlant, joint: Joint, frame: Frame) -> list[Joint] | None:
    """Returns the joints that move between a joint and a frame; None if it is not beyond at all."""
    path = [further for further, _ in KinematicTree(plant, set()).path_from_world(frame.body())]
    places = [further.index() for further in path]
    if joint.index() not in places:
        return None
    beyond = path[places.index(joint.index()) + 1 :]
    return [further for further in beyond if not isinstance(further, WeldJoint)]


def path_to(plant: MultibodyPlant, frame: Frame) -> Array | None:
    """Returns the joints between the world and a frame as `path_motion.pose_along` takes them.

    Args:
        plant: finalized.
        frame: fixed in a body of the plant.

    Returns:
        (n + 1, 18), or None if a joint is neither a weld nor revolute nor prismatic, or was
        declared from the hand to the base.
    """
    rows = []
    X_MP = RigidTransform()  # of the body before a joint in the frame that moves with it
    for joint, far in KinematicTree(plant, set()).path_from_world(frame.body()):
        X_PF = joint.frame_on_parent().GetFixedPoseInBodyFrame()
        X_MC = joint.frame_on_child().GetFixedPoseInBodyFrame().inverse()
        if isinstance(joint, WeldJoint):
            X_PC = X_PF @ joint.X_FM() @ X_MC
            X_MP @= X_PC if joint.child_body().index() == far.index() else X_PC.inverse()
            continue
        if joint.child_body().index() != far.index():
            return None
        if isinstance(joint, RevoluteJoint):
            axis, turns = joint.revolute_axis(), 1.0
        elif isinstance(joint, PrismaticJoint):
            axis, turns = joint.translation_axis(), 0.0
        else:
            return None
        X_MF = (X_MP @ X_PF).GetAsMatrix34().ravel()
        places = float(joint.position_start()), float(joint.velocity_start())
        rows.append([*X_MF, *axis, turns, *places])
        X_MP = X_MC
    X_MP @= frame.GetFixedPoseInBodyFrame()
    rows.append([*X_MP.GetAsMatrix34().ravel(), *np.zeros(6)])
    return np.array(rows)


class KinematicTree:
    """The plant's joints as a tree rooted in the world."""

    def __init__(self, plant: MultibodyPlant, without: set[ModelInstanceIndex]):
        self.plant = plant
        self.context = plant.CreateDefaultContext()
        self._without = without
        joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
        neighbours: dict[BodyIndex, Chain] = {}
        for joint in joints:
            parent, child = joint.parent_body(), joint.child_body()
            neighbours.setdefault(parent.index(), []).append((joint, child))
            neighbours.setdefault(child.index(), []).append((joint, parent))
        self.inboard: dict[BodyIndex, tuple[Joint, RigidBody]] = {}
        self.outboard: dict[BodyIndex, Chain] = {}
        world = plant.world_body()
        seen, front = {world.index()}, [world]
        for body in front:
            for joint, other in neighbours.get(body.index(), []):
                if other.index() in seen:
                    continue
                seen.add(other.index())
                front.append(other)
                self.inboard[other.index()] = (joint, body)
                self.outboard.setdefault(body.index(), []).append((joint, other))

    def path_from_world(self, body: RigidBody) -> Chain:
        """Returns the joints from the world to a body, each with the body on its far side."""
        path = []
        while body.index() in self.inboard:
            joint, parent = self.inboard[body.index()]
            path.append((joint, body))
            body = parent
        return path[::-1]

    def far_side(self, joint: Joint) -> RigidBody:
        """Returns the one of a joint's two bodies that is farther from the world."""
        child = joint.child_body()
        inboard = self.inboard.get(child.index())
        reaches_child = inboard is not None and inboard[0].index() == joint.index()
        return child if reaches_child else joint.parent_body()

    def carried_by(
        self, body: BodyIndex, *, through_joints: bool, stop: Joint | None = None
    ) -> list[RigidBody]:
        """Returns a body and all that moves with it when joints further out are locked.

        `stop` is the joint of the chain at which the next link begins.
        """
        carried = [self.plant.get_body(body)]
        for link in carried:
            for joint, child in self.outboard.get(link.index(), []):
                if joint is stop or child.model_instance() in self._without:
                    continue
                if through_joints or isinstance(joint, WeldJoint):
                    carried.append(child)
        return carried

    def relative_pose(self, A: Frame, B: Frame) -> RigidTransform:
        """Returns X_AB in the default posture."""
        return B.CalcPose(self.context, A)
