"""Copying an arm out of a plant into another, its welded bodies merged."""

import numpy as np
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
    UnitInertia,
)

from geoimp_drake.arm.friction_inertia import friction_inertia
from geoimp_drake.arm.kinematic_tree import Chain, KinematicTree
from geoimp_drake.errors import ModelError

__all__ = ["copy_arm"]


def copy_arm(
    tree: KinematicTree,
    chain: Chain,
    actuators: list[JointActuator],
    end_effector_frame: Frame,
    model: MultibodyPlant,
    model_instance: ModelInstanceIndex,
) -> Frame:
    """Copies an arm into another plant, one link a joint: bodies welded together become one.

    Args:
        tree: of the plant that contains the arm.
        chain: the arm's moving joints from base to hand, each with the body on its far side.
        actuators: one per joint.
        end_effector_frame: E in the arm's plant.
        model: where the copy is added; not finalized.
        model_instance: the arm in its plant; the copy's instance gets its name and gravity.

    Returns:
        The frame E in `model`.

    Raises:
        ModelError: gravity is on for a part of the arm and off for another.
    """
    joints = [joint for joint, _ in chain]
    gravity = tree.plant.is_gravity_enabled(model_instance)
    instance = model.AddModelInstance(tree.plant.GetModelInstanceName(model_instance))
    # A is the link that carries the joint: its frame in the original and in the copy.
    A, A_copy = tree.plant.world_frame(), model.world_frame()
    for k, (joint, link) in enumerate(chain):
        carried = tree.carried_by(
            link.index(),
            through_joints=k == len(chain) - 1,
            stop=joints[k + 1] if k + 1 < len(chain) else None,
        )
        _check_gravity(tree.plant, carried, gravity)
        body = model.AddRigidBody(link.name(), instance, _merged_inertia(tree, link, carried))
        copy = _copy_joint(tree, joint, link, A, A_copy, body, model)
        actuator = model.AddJointActuator(actuators[k].name(), copy, actuators[k].effort_limit())
        (implicit,) = friction_inertia(tree.plant, joint)
        actuator.set_default_rotor_inertia(actuators[k].default_reflected_inertia() + implicit)
        A, A_copy = link.body_frame(), body.body_frame()
    model.set_gravity_enabled(instance, gravity)
    X_AE = tree.relative_pose(A, end_effector_frame)
    # Not by its own name alone: E may be the frame of a link, whose name is taken.
    name = f"{end_effector_frame.name()}_E"
    return model.AddFrame(FixedOffsetFrame(name, A_copy, X_AE, instance))


def _copy_joint(
    tree: KinematicTree,
    joint: Joint,
    link: RigidBody,
    A: Frame,
    A_copy: Frame,
    body: RigidBody,
    model: MultibodyPlant,
) -> Joint:
    """Copies a revolute or prismatic joint between link A (inboard) and `link` (outboard)."""
    F, M = joint.frame_on_parent(), joint.frame_on_child()
    axis = joint.revolute_axis() if isinstance(joint, RevoluteJoint) else joint.translation_axis()
    if joint.parent_body().index() == link.index():
        # The joint was declared from the hand to the base: the same motion with the ends
        # exchanged is about the opposite axis.
        F, M, axis = M, F, -axis
    name = joint.name()
    F_copy = model.AddFrame(FixedOffsetFrame(f"{name}_F", A_copy, tree.relative_pose(A, F)))
    M_copy = model.AddFrame(
        FixedOffsetFrame(f"{name}_M", body.body_frame(), tree.relative_pose(link.body_frame(), M))
    )
    kind = RevoluteJoint if isinstance(joint, RevoluteJoint) else PrismaticJoint
    copy = model.AddJoint(
        kind(
            name,
            F_copy,
            M_copy,
            axis,
            joint.position_lower_limit(),
            joint.position_upper_limit(),
            joint.default_damping(),
        )
    )
    copy.set_default_positions(joint.default_positions())
    return copy


def _merged_inertia(
    tree: KinematicTree, link: RigidBody, carried: list[RigidBody]
) -> SpatialInertia:
    """Returns the spatial inertia of bodies welded together, about the link's origin, in L."""
    total = SpatialInertia(0.0, np.zeros(3), UnitInertia(0.0, 0.0, 0.0), skip_validity_check=True)
    for body in carried:
        X_LB = tree.relative_pose(link.body_frame(), body.body_frame())
        M_BBo_L = body.default_spatial_inertia().ReExpress(X_LB.rotation())
        if body.default_mass() > 0:
            total += M_BBo_L.Shift(-X_LB.translation())
    return total


def _check_gravity(plant: MultibodyPlant, carried: list[RigidBody], expected: bool) -> None:
    for body in carried:
        if plant.is_gravity_enabled(body.model_instance()) != expected and body.default_mass() > 0:
            raise ModelError(
                f"Gravity is {'off' if expected else 'on'} for '{body.scoped_name()}' but "
                f"{'on' if expected else 'off'} for the arm that carries it; set both alike with "
                f"plant.set_gravity_enabled()."
            )
