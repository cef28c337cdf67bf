"""The plant of a run as its world is: changed in its Context, so that models of it are nominal.

Controllers and sensors take their models from the plant's default parameters, which stay as they
are. Coulomb friction is a second actuator of each joint that holds it still with a limited torque:
implicit, so that a joint sticks, with creep of that torque over a very stiff damping.
"""

from collections.abc import Iterator, Mapping
from copy import copy

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    Joint,
    ModelInstanceIndex,
    PdControllerGains,
    RigidBody,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.primitives import ConstantVectorSource, DiscreteTimeDelay, MatrixGain

from geoimp_drake.diagrams.setups.world import PayloadError, WorldConfig
from geoimp_drake.simulation.recorder import Recorder

__all__ = ["TruePlant", "add_friction"]

# Of the actuators that stand for Coulomb friction: hardly a position, an all but rigid damping.
_HOLDING = PdControllerGains(p=1e-6, d=1e6)


def add_friction(plant: MultibodyPlant, world: WorldConfig) -> None:
    """Adds Coulomb friction to every actuated joint of a plant that is not finalized."""
    if not world.joints.coulomb:
        return
    for index in plant.GetJointActuatorIndices():
        actuator = plant.get_joint_actuator(index)
        torque = world.joints.coulomb * actuator.effort_limit()
        friction = plant.AddJointActuator(f"{actuator.name()}_friction", actuator.joint(), torque)
        friction.set_controller_gains(_HOLDING)


class TruePlant:
    """The plant of a diagram under construction, and what its world changes in it.

    Args:
        plant: finalized, with its friction; in `builder`.
        builder: of the diagram.
        world: draws are filled in.
        seed: of the run.
    """

    def __init__(
        self, plant: MultibodyPlant, builder: DiagramBuilder, world: WorldConfig, seed: int
    ):
        self._plant, self._builder, self._world = plant, builder, world
        self._delays: list[tuple[DiscreteTimeDelay, OutputPort]] = []
        self._payloads: list[tuple[RigidBody, PayloadError, RigidTransform]] = []
        self._arms = [
            instance
            for instance in map(ModelInstanceIndex, range(plant.num_model_instances()))
            if plant.num_actuators(instance) > 0
        ]
        if world.joints.coulomb:
            self._hold_friction()
        world.links.draw(
            [link.scoped_name().get_full() for link in self._links()], seed + world.seed
        )

    def _hold_friction(self) -> None:
        for arm in self._arms:
            port = self._plant.get_desired_state_input_port(arm)
            still = ConstantVectorSource(np.zeros(port.size()))
            name = f"{self._plant.GetModelInstanceName(arm)}_friction"
            source = self._builder.AddNamedSystem(name, still)
            self._builder.Connect(source.get_output_port(), port)

    def connect_torques(self, torques: OutputPort, arm: ModelInstanceIndex) -> None:
        """Connects a controller's torques (n) to an arm, with the delay of its world."""
        name = self._plant.GetModelInstanceName(arm)
        steps = self._world.delay_steps(self._plant.time_step())
        if steps:
            delay = DiscreteTimeDelay(self._plant.time_step(), steps, torques.size())
            system = self._builder.AddNamedSystem(f"{name}_torque_delay", delay)
            self._builder.Connect(torques, system.get_input_port())
            self._delays.append((delay, torques))
            torques = system.get_output_port()
        port = self._plant.get_actuation_input_port(arm)
        if port.size() > torques.size():  # the friction's actuators come last
            pad = MatrixGain(np.eye(port.size(), torques.size()))
            system = self._builder.AddNamedSystem(f"{name}_torques", pad)
            self._builder.Connect(torques, system.get_input_port())
            torques = system.get_output_port()
        self._builder.Connect(torques, port)

    def hang_payloads(self, sensor: Joint) -> None:
        """Has the payloads of the world hang before and beyond an arm's wrist sensor, a weld."""
        for body, payload, X_BS in (
            (sensor.parent_body(), self._world.payload_before, sensor.frame_on_parent()),
            (sensor.child_body(), self._world.payload_beyond, sensor.frame_on_child()),
        ):
            if payload.mass:
                self._payloads.append((body, payload, X_BS.GetFixedPoseInBodyFrame()))

    def record(self, recorder: Recorder) -> None:
        """Puts what is true, beside what the controller knows, into the log."""
        plant, true = self._plant, self._true_inertias()
        indices = plant.GetJointActuatorIndices() if self._world.joints.coulomb else []
        actuators = [plant.get_joint_actuator(index) for index in indices]
        friction = [actuator for actuator in actuators if actuator.has_controller()]
        joints = [
            f"{plant.GetModelInstanceName(actuator.model_instance())}::{actuator.joint().name()}"
            for actuator in friction
        ]
        recorder.constant("world/joints", np.array(joints))
        recorder.constant(
            "world/coulomb", np.array([actuator.effort_limit() for actuator in friction])
        )
        recorder.constant("world/bodies", np.array(list(true)))
        masses = [(M.get_mass(), self._body(name).default_mass()) for name, M in true.items()]
        recorder.constant("world/masses", np.array(masses))

    def apply(self, context: Context) -> None:
        """Changes the plant's parameters in the context of the whole diagram."""
        own = self._plant.GetMyMutableContextFromRoot(context)
        for name, M in self._true_inertias().items():
            self._body(name).SetSpatialInertiaInBodyFrame(own, M)
        if self._world.joints.viscous != 1.0:
            for joint in self._joints():
                damping = self._world.joints.viscous * joint.default_damping_vector()
                joint.SetDampingVector(own, damping)

        for delay, torques in self._delays:
            # What a controller at rest has sent so far.
            sent = torques.Eval(torques.get_system().GetMyContextFromRoot(context))
            state = delay.GetMyMutableContextFromRoot(context).get_mutable_discrete_state_vector()
            state.SetFromVector(np.tile(sent, state.size() // len(sent)))

    def _true_inertias(self) -> Mapping[str, SpatialInertia]:
        """Returns the inertia of each body that is not as the controller knows it, by name."""
        true = {}
        if not self._world.links.is_none():
            true = {link.scoped_name().get_full(): self._true_link(link) for link in self._links()}
        for body, payload, X_BS in self._payloads:
            name, centre = body.scoped_name().get_full(), X_BS @ payload.centre
            added = SpatialInertia(payload.mass, centre, UnitInertia.PointMass(centre))
            total = copy(true.get(name, body.default_spatial_inertia()))
            total += added
            true[name] = total
        return true

    def _true_link(self, link: RigidBody) -> SpatialInertia:
        mass, inertia, shift = self._world.links.of(link.scoped_name().get_full())
        M = link.default_spatial_inertia()
        G = inertia * M.Shift(M.get_com()).get_unit_inertia().CopyToFullMatrix3()
        about_centre = UnitInertia(*np.diag(G), G[0, 1], G[0, 2], G[1, 2])
        return SpatialInertia(mass * M.get_mass(), np.zeros(3), about_centre).Shift(
            -(M.get_com() + shift)
        )

    def _body(self, name: str) -> RigidBody:
        instance, _, body = name.rpartition("::")
        return self._plant.GetBodyByName(body, self._plant.GetModelInstanceByName(instance))

    def _joints(self) -> Iterator[Joint]:
        for arm in self._arms:
            for joint in map(self._plant.get_joint, self._plant.GetJointIndices(arm)):
                if joint.num_velocities() > 0:
                    yield joint

    def _links(self) -> Iterator[RigidBody]:
        """Yields the bodies of the arms that move and have a mass."""
        anchored = {
            body.index() for body in self._plant.GetBodiesWeldedTo(self._plant.world_body())
        }
        for arm in self._arms:
            for body in map(self._plant.get_body, self._plant.GetBodyIndices(arm)):
                if body.index() not in anchored and body.default_mass() > 0.0:
                    yield body
