"""The controller's own model of one arm, taken out of anybody's finalized plant.

The model holds the joints on the way from the world to the end-effector frame and the bodies that
they carry, welded ones merged into one link each: as many bodies as joints, whatever else the
plant contains.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BodyIndex,
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
    WeldJoint,
)

from geoimp_drake.errors import ModelError
from geoimp_drake.typing import Array

__all__ = ["TASK_DIMENSION", "ControlModel", "welded_bodies"]

TASK_DIMENSION = 6


@dataclass(frozen=True)
class ControlModel:
    """One arm as its controller knows it.

    Attributes:
        plant: a finalized plant with this arm alone, one body a joint, gravity included.
        end_effector: the frame E in it.
        viscous_friction: F of (2.2), one a joint [Nm s/rad or N s/m].
        effort_limits: of the actuators, one a joint [Nm or N].
        joint_names: from the base to the hand, the order of every vector of this model.
        state_order: where this model's [q; v] stand in the state of the model instance.
        actuation_order: which joint each actuator of the model instance drives.
    """

    plant: MultibodyPlant
    end_effector: Frame
    viscous_friction: Array
    effort_limits: Array
    joint_names: tuple[str, ...]
    state_order: Array
    actuation_order: Array

    @property
    def num_joints(self) -> int:
        """Number n of joints."""
        return len(self.joint_names)

    @staticmethod
    def of_arm(
        plant: MultibodyPlant,
        model_instance: ModelInstanceIndex,
        end_effector_frame: Frame,
        without: Sequence[ModelInstanceIndex] = (),
    ) -> "ControlModel":
        """Makes the control model of an arm in `plant`.

        Args:
            plant: a finalized plant that contains the arm, at any base pose.
            model_instance: the arm; six or more revolute or prismatic joints, one actuator each.
            end_effector_frame: E, fixed in the arm's last link or in something welded to it.
            without: model instances that hang on the arm but are not part of its model (a load
                whose weight stays in the measured wrench).

        Raises:
            ModelError: the plant does not contain such an arm; the message says what is missing.
        """
        if not plant.is_finalized():
            raise ModelError("The plant is not finalized; call plant.Finalize() first.")
        _check_own(plant, model_instance, end_effector_frame)
        tree = _Tree(plant, set(without))
        chain = _chain_of(tree, model_instance, end_effector_frame)
        actuators = _actuators_of(plant, model_instance, chain)
        model = MultibodyPlant(time_step=0.0)
        model.mutable_gravity_field().set_gravity_vector(plant.gravity_field().gravity_vector())
        E = _copy_arm(tree, chain, actuators, end_effector_frame, model, model_instance)
        model.Finalize()
        return ControlModel(
            plant=model,
            end_effector=E,
            viscous_friction=np.array([joint.default_damping() for joint, _ in chain]),
            effort_limits=np.array([actuator.effort_limit() for actuator in actuators]),
            joint_names=tuple(joint.name() for joint, _ in chain),
            state_order=_state_order(plant, model_instance, chain),
            actuation_order=_actuation_order(plant, model_instance, chain),
        )


def welded_bodies(
    plant: MultibodyPlant, joint: Joint, without: Sequence[ModelInstanceIndex] = ()
) -> list[RigidBody]:
    """Returns what a weld joint carries: the body on its far side and all that moves with it.

    Joints further out (a gripper's fingers) count as locked. The first body is the far side: the
    joint's parent if the joint was declared from the hand to the base.
    """
    tree = _Tree(plant, set(without))
    return tree.carried_by(tree.far_side(joint).index(), through_joints=True)


class _Tree:
    """The plant's joints as a tree that grows from the world."""

    def __init__(self, plant: MultibodyPlant, without: set[ModelInstanceIndex]):
        self.plant = plant
        self.context = plant.CreateDefaultContext()
        self._without = without
        joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
        neighbours: dict[BodyIndex, list[tuple[Joint, RigidBody]]] = {}
        for joint in joints:
            parent, child = joint.parent_body(), joint.child_body()
            neighbours.setdefault(parent.index(), []).append((joint, child))
            neighbours.setdefault(child.index(), []).append((joint, parent))
        self.inboard: dict[BodyIndex, tuple[Joint, RigidBody]] = {}
        self.outboard: dict[BodyIndex, list[tuple[Joint, RigidBody]]] = {}
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

    def path_from_world(self, body: RigidBody) -> list[tuple[Joint, RigidBody]]:
        """Returns the joints from the world to a body, each with the body on its far side."""
        path = []
        while body.index() in self.inboard:
            joint, parent = self.inboard[body.index()]
            path.append((joint, body))
            body = parent
        return path[::-1]

    def far_side(self, joint: Joint) -> RigidBody:
        """Returns the body of a joint that is further from the world."""
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


def _check_own(plant: MultibodyPlant, model_instance: ModelInstanceIndex, E: Frame) -> None:
    """Raises ModelError if the instance or the frame is not one of this plant."""
    if not 0 <= int(model_instance) < plant.num_model_instances():
        raise ModelError(
            f"Model instance {int(model_instance)} is not in this plant, which has "
            f"{plant.num_model_instances()}; get one with plant.GetModelInstanceByName()."
        )
    if E.GetParentPlant() is not plant:
        raise ModelError(
            f"Frame '{E.name()}' belongs to another plant; get it with "
            f"plant.GetFrameByName('{E.name()}')."
        )


def _chain_of(
    tree: _Tree, model_instance: ModelInstanceIndex, E: Frame
) -> list[tuple[Joint, RigidBody]]:
    """Returns the arm's moving joints from base to hand, each with the body on its far side."""
    plant = tree.plant
    arm = plant.GetModelInstanceName(model_instance)
    moving = [
        (joint, body)
        for joint, body in tree.path_from_world(E.body())
        if not isinstance(joint, WeldJoint)
    ]
    for joint, _ in moving:
        if not isinstance(joint, RevoluteJoint | PrismaticJoint):
            raise ModelError(
                f"Joint '{joint.name()}' between the world and frame '{E.name()}' is of type "
                f"'{joint.type_name()}'; an arm is made of revolute and prismatic joints on a base "
                f"that is welded to the world. Weld the base of '{arm}' with plant.WeldFrames()."
            )
    _check_instance(plant, model_instance, moving, E)
    if len(moving) < TASK_DIMENSION:
        raise ModelError(
            f"'{arm}' has {len(moving)} joints between the world and frame '{E.name()}' "
            f"({', '.join(joint.name() for joint, _ in moving) or 'none'}); six-DOF impedance "
            f"needs at least {TASK_DIMENSION}."
        )
    return moving


def _check_instance(
    plant: MultibodyPlant,
    model_instance: ModelInstanceIndex,
    moving: list[tuple[Joint, RigidBody]],
    E: Frame,
) -> None:
    """Raises ModelError unless the chain's joints are exactly the instance's moving joints."""
    arm = plant.GetModelInstanceName(model_instance)
    on_chain = {joint.index() for joint, _ in moving}
    own = {
        index
        for index in plant.GetJointIndices(model_instance)
        if plant.get_joint(index).num_velocities() > 0
    }

    def names(indices: Any) -> str:
        return ", ".join(f"'{plant.get_joint(index).name()}'" for index in sorted(indices, key=int))

    if on_chain - own:
        raise ModelError(
            f"Frame '{E.name()}' is moved by joints that do not belong to '{arm}': "
            f"{names(on_chain - own)}. Name the model instance that has all the arm's joints."
        )
    if own - on_chain:
        raise ModelError(
            f"'{arm}' has joints that do not move frame '{E.name()}': {names(own - on_chain)}. Put "
            f"a gripper into a model instance of its own (its joints then count as locked)."
        )


def _actuators_of(
    plant: MultibodyPlant,
    model_instance: ModelInstanceIndex,
    chain: list[tuple[Joint, RigidBody]],
) -> list[JointActuator]:
    """Returns the actuator of each joint of the chain."""
    by_joint = {
        actuator.joint().index(): actuator
        for actuator in map(plant.get_joint_actuator, plant.GetJointActuatorIndices(model_instance))
    }
    missing = [joint.name() for joint, _ in chain if joint.index() not in by_joint]
    if missing:
        raise ModelError(
            f"'{plant.GetModelInstanceName(model_instance)}' has no actuator at: "
            f"{', '.join(missing)}. Add a <transmission> to the URDF or call "
            f"plant.AddJointActuator(name, joint) before Finalize()."
        )
    return [by_joint[joint.index()] for joint, _ in chain]


def _copy_arm(
    tree: _Tree,
    chain: list[tuple[Joint, RigidBody]],
    actuators: list[JointActuator],
    end_effector_frame: Frame,
    model: MultibodyPlant,
    model_instance: ModelInstanceIndex,
) -> Frame:
    """Copies the chain into `model`, one merged link a joint; returns E there."""
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
        actuator.set_default_rotor_inertia(actuators[k].default_rotor_inertia())
        actuator.set_default_gear_ratio(actuators[k].default_gear_ratio())
        A, A_copy = link.body_frame(), body.body_frame()
    model.set_gravity_enabled(instance, gravity)
    X_AE = tree.relative_pose(A, end_effector_frame)
    # Not by its own name alone: E may be the frame of a link, whose name is taken.
    name = f"{end_effector_frame.name()}_E"
    return model.AddFrame(FixedOffsetFrame(name, A_copy, X_AE, instance))


def _copy_joint(
    tree: _Tree,
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


def _merged_inertia(tree: _Tree, link: RigidBody, carried: list[RigidBody]) -> SpatialInertia:
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


def _state_order(
    plant: MultibodyPlant, model_instance: ModelInstanceIndex, chain: list[tuple[Joint, RigidBody]]
) -> Array:
    """Returns where the chain's [q; v] stand in the model instance's state."""
    nq, nv = plant.num_positions(model_instance), plant.num_velocities(model_instance)
    q_of = plant.GetPositionsFromArray(model_instance, np.arange(plant.num_positions()))
    v_of = plant.GetVelocitiesFromArray(model_instance, np.arange(plant.num_velocities()))
    q = [int(np.flatnonzero(q_of == joint.position_start())[0]) for joint, _ in chain]
    v = [int(np.flatnonzero(v_of == joint.velocity_start())[0]) for joint, _ in chain]
    if sorted(q) != list(range(nq)) or sorted(v) != list(range(nv)):
        raise ModelError(
            f"'{plant.GetModelInstanceName(model_instance)}' has {nq} positions and {nv} "
            f"velocities, but its joints account for {len(q)}; a floating body in the same model "
            f"instance? Give it an instance of its own."
        )
    return np.array(q + [nq + i for i in v])


def _actuation_order(
    plant: MultibodyPlant, model_instance: ModelInstanceIndex, chain: list[tuple[Joint, RigidBody]]
) -> Array:
    """Returns, for each actuator of the model instance, the index of its joint in the chain."""
    position = {joint.index(): k for k, (joint, _) in enumerate(chain)}
    actuators = map(plant.get_joint_actuator, plant.GetJointActuatorIndices(model_instance))
    ordered = sorted(actuators, key=lambda actuator: actuator.input_start())
    return np.array([position[actuator.joint().index()] for actuator in ordered])
