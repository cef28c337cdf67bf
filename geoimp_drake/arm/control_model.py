"""The controller's own model of one arm, taken out of any finalized plant.

The model holds the joints on the way from the world to the end-effector frame, and the bodies that
they carry. Bodies welded together are merged into one link, so it has as many bodies as joints,
whatever else the plant contains.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    Frame,
    JointActuator,
    JointIndex,
    ModelInstanceIndex,
    PrismaticJoint,
    RevoluteJoint,
    WeldJoint,
)

from geoimp_drake.arm.copy_arm import copy_arm
from geoimp_drake.arm.kinematic_tree import Chain, KinematicTree
from geoimp_drake.errors import ModelError, drake_errors
from geoimp_drake.typing import Array

__all__ = ["TASK_DIMENSION", "ControlModel"]

TASK_DIMENSION = 6


@dataclass(frozen=True)
class ControlModel:
    """One arm as its controller knows it.

    The rotor inertias of this model include the Δt F that friction adds in a discrete plant's step,
    see `friction_inertia`.

    Attributes:
        plant: a finalized plant with this arm alone, one body a joint, gravity included.
        end_effector: the frame E in it.
        viscous_friction: F of (2.2), one per joint [Nm s/rad or N s/m].
        effort_limits: of the actuators, one per joint [Nm or N].
        position_limits: lower and upper limits of the joint positions (2, n) [rad or m].
        velocity_limits: the same for the velocities (2, n) [rad/s or m/s].
        joint_names: from the base to the hand, the order of every vector of this model.
        state_order: index of each entry of this model's [q; v] in the state of the model instance.
        actuation_order: which joint each actuator of the model instance drives.
        time_step: Δt of the plant that it was taken from, zero if that is continuous [s].
    """

    plant: MultibodyPlant
    end_effector: Frame
    viscous_friction: Array
    effort_limits: Array
    position_limits: Array
    velocity_limits: Array
    joint_names: tuple[str, ...]
    state_order: Array
    actuation_order: Array
    time_step: float

    @property
    def num_joints(self) -> int:
        """Number n of joints."""
        return len(self.joint_names)

    @cached_property
    def turns(self) -> Array:
        """One for each joint that turns, zero for one that slides (n)."""
        joints = map(self.plant.GetJointByName, self.joint_names)
        return np.array([float(isinstance(joint, RevoluteJoint)) for joint in joints])

    @cached_property
    def world(self) -> Frame:
        """The frame W of `plant`."""
        return self.plant.world_frame()

    @cached_property
    def autodiff(self) -> "ControlModel":
        """The same model with a plant for `AutoDiffXd`."""
        plant = self.plant.ToAutoDiffXd()
        return replace(self, plant=plant, end_effector=plant.get_frame(self.end_effector.index()))

    def in_plant_order(self, q: Array) -> Array:
        """Returns joint positions (n) in the order of the model instance."""
        positions = np.empty_like(q)
        positions[self.state_order[: self.num_joints]] = q
        return positions

    @staticmethod
    def of_arm(
        plant: MultibodyPlant,
        model_instance: ModelInstanceIndex,
        end_effector_frame: Frame,
        without: Sequence[ModelInstanceIndex] = (),
        *,
        gravity: bool = True,
    ) -> "ControlModel":
        """Makes the control model of an arm in `plant`.

        Args:
            plant: a finalized plant that contains the arm, at any base pose.
            model_instance: the arm; six or more revolute or prismatic joints, one actuator each.
            end_effector_frame: E, fixed in the arm's last link or in something welded to it.
            without: model instances that hang on the arm but are not part of its model (a load
                whose weight stays in the measured wrench).
            gravity: whether the arm has weight; false if the robot compensates gravity itself.

        Raises:
            ModelError: the plant does not contain such an arm; the message says what is missing.
        """
        if not plant.is_finalized():
            raise ModelError("The plant is not finalized; call plant.Finalize() first.")
        _check_own(plant, model_instance, end_effector_frame)
        tree = KinematicTree(plant, set(without))
        chain = _chain_of(tree, model_instance, end_effector_frame)
        actuators = _actuators_of(plant, model_instance, chain)
        model = MultibodyPlant(time_step=0.0)
        weight = plant.gravity_field().gravity_vector() * float(gravity)
        model.mutable_gravity_field().set_gravity_vector(weight)
        arm = f"'{plant.GetModelInstanceName(model_instance)}' cannot be modelled"
        with drake_errors(ModelError, arm):
            E = copy_arm(tree, chain, actuators, end_effector_frame, model, model_instance)
            model.Finalize()
        return ControlModel(
            plant=model,
            end_effector=E,
            viscous_friction=np.array([joint.default_damping() for joint, _ in chain]),
            effort_limits=np.array([actuator.effort_limit() for actuator in actuators]),
            position_limits=_limits_of(chain, "position"),
            velocity_limits=_limits_of(chain, "velocity"),
            joint_names=tuple(joint.name() for joint, _ in chain),
            state_order=_state_order(plant, model_instance, chain),
            actuation_order=_actuation_order(actuators),
            time_step=plant.time_step(),
        )


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


def _chain_of(tree: KinematicTree, model_instance: ModelInstanceIndex, E: Frame) -> Chain:
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
    moving: Chain,
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
    chain: Chain,
) -> list[JointActuator]:
    """Returns the actuator of each joint of the chain."""
    # Where a joint has several actuators, the arm uses the first.
    by_joint: dict[JointIndex, JointActuator] = {}
    for actuator in map(plant.get_joint_actuator, plant.GetJointActuatorIndices(model_instance)):
        by_joint.setdefault(actuator.joint().index(), actuator)
    missing = [joint.name() for joint, _ in chain if joint.index() not in by_joint]
    if missing:
        raise ModelError(
            f"'{plant.GetModelInstanceName(model_instance)}' has no actuator at: "
            f"{', '.join(missing)}. Add a <transmission> to the URDF or call "
            f"plant.AddJointActuator(name, joint) before Finalize()."
        )
    return [by_joint[joint.index()] for joint, _ in chain]


def _limits_of(chain: Chain, quantity: str) -> Array:
    """Returns the lower and upper limits of the joints' `position` or `velocity` (2, n)."""
    return np.array(
        [
            [getattr(joint, f"{quantity}_{side}_limits")()[0] for joint, _ in chain]
            for side in ("lower", "upper")
        ]
    )


def _state_order(plant: MultibodyPlant, model_instance: ModelInstanceIndex, chain: Chain) -> Array:
    """Returns the indices of the chain's [q; v] in the model instance's state."""
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


def _actuation_order(actuators: list[JointActuator]) -> Array:
    """Returns the index in the chain of each actuator, in the order of the model instance."""
    return np.argsort([actuator.input_start() for actuator in actuators])
