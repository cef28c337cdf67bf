"""The true plant of a run's world: only its Context is changed, so that models of it are nominal.

Controllers and sensors take their models from the plant's default parameters, which stay as they
are. Coulomb friction is a second actuator of each joint, which holds it still with a limited
torque. It is implicit, so that a joint sticks; it creeps with that torque over a very stiff
damping. If the friction falls with the velocity (Stribeck), the limit is the largest friction, and
the excess pushes a moving joint.
"""

from collections.abc import Iterator, Mapping
from copy import copy

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    Joint,
    JointActuator,
    ModelInstanceIndex,
    PdControllerGains,
    RigidBody,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.framework import Context, DiagramBuilder, InputPort, OutputPort
from pydrake.systems.primitives import (
    ConstantVectorSource,
    DiscreteTimeDelay,
    MatrixGain,
)

from geoimp_drake.arm.kinematic_tree import path_to
from geoimp_drake.diagrams.setups.arm_log import true_motion
from geoimp_drake.diagrams.setups.joint_errors import VectorFunction, fallen_friction, rounded
from geoimp_drake.diagrams.setups.world import PayloadError, WorldConfig
from geoimp_drake.simulation.recorder import Recorder
from geoimp_drake.typing import Array

__all__ = ["TruePlant", "add_friction"]

# Gains of the actuators that stand for Coulomb friction: hardly a stiffness, an almost rigid
# damping.
_HOLDING = PdControllerGains(p=1e-6, d=1e6)


def add_friction(plant: MultibodyPlant, world: WorldConfig) -> None:
    """Adds Coulomb friction to every actuated joint of a plant that is not finalized."""
    if not world.joints.coulomb:
        return
    for index in plant.GetJointActuatorIndices():
        actuator = plant.get_joint_actuator(index)
        torque = (1.0 + world.joints.stribeck) * world.joints.coulomb * actuator.effort_limit()
        friction = plant.AddJointActuator(f"{actuator.name()}_friction", actuator.joint(), torque)
        friction.set_controller_gains(_HOLDING)
        # Drake takes the rotor of a joint's last actuator for the joint's.
        friction.set_default_rotor_inertia(actuator.default_rotor_inertia())
        friction.set_default_gear_ratio(actuator.default_gear_ratio())


class TruePlant:
    """The plant of a diagram under construction, and the changes by its world.

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
        if world.joints.stribeck:
            self._release_friction()
        world.links.draw(
            [link.scoped_name().get_full() for link in self._links()], seed + world.seed
        )
        world.kinematics.draw(list(self._frames()), seed + world.seed)

    def _hold_friction(self) -> None:
        for arm in self._arms:
            port = self._plant.get_desired_state_input_port(arm)
            still = ConstantVectorSource(np.zeros(port.size()))
            name = f"{self._plant.GetModelInstanceName(arm)}_friction"
            source = self._builder.AddNamedSystem(name, still)
            self._builder.Connect(source.get_output_port(), port)

    def _release_friction(self) -> None:
        """Pushes moving joints by the excess of the largest friction over the present one."""
        plant, joints, n = self._plant, self._world.joints, self._plant.num_velocities()
        fall = np.zeros(n)
        for actuator in self._friction():
            excess = joints.stribeck / (1.0 + joints.stribeck) * actuator.effort_limit()
            fall[actuator.joint().velocity_start()] = excess

        def push(state: Array) -> Array:
            return fallen_friction(state[-n:], fall, joints.stribeck_velocity)

        system = self._builder.AddNamedSystem(
            "falling_friction", VectorFunction(push, plant.num_multibody_states(), n)
        )
        self._builder.Connect(plant.get_state_output_port(), system.get_input_port())
        self._builder.Connect(
            system.get_output_port(), plant.get_applied_generalized_force_input_port()
        )

    def connect_readings(self, arm: ModelInstanceIndex, readings: InputPort) -> None:
        """Connects the state of an arm [q; v] to its reader, with q as the encoders read it."""
        port, step = self._plant.get_state_output_port(arm), self._world.encoder_resolution
        if step:
            n = self._plant.num_positions(arm)

            def read(state: Array) -> Array:
                return np.concatenate((rounded(state[:n], step), state[n:]))

            name = f"{self._plant.GetModelInstanceName(arm)}_encoders"
            if self._builder.HasSubsystemNamed(name):
                encoders = self._builder.GetSubsystemByName(name)
            else:
                encoders = self._builder.AddNamedSystem(name, VectorFunction(read, port.size()))
                self._builder.Connect(port, encoders.get_input_port())
            port = encoders.get_output_port()
        self._builder.Connect(port, readings)

    def motion(self, frame: Frame, name: str) -> OutputPort:
        """Adds a system `name` that reads the true motion of a frame; returns its port."""
        # A path assumes the joints to be where the controller believes them.
        path = path_to(self._plant, frame) if self._world.kinematics.is_none() else None
        return true_motion(self._builder, self._plant, frame, name, path)

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
        """Hangs the payloads of the world before and beyond an arm's wrist sensor, a weld."""
        for body, payload, X_BS in (
            (sensor.parent_body(), self._world.payload_before, sensor.frame_on_parent()),
            (sensor.child_body(), self._world.payload_beyond, sensor.frame_on_child()),
        ):
            if payload.mass:
                self._payloads.append((body, payload, X_BS.GetFixedPoseInBodyFrame()))

    def record(self, recorder: Recorder) -> None:
        """Logs true values beside those that the controller knows."""
        plant, true, friction = self._plant, self._true_inertias(), list(self._friction())
        joints = [
            f"{plant.GetModelInstanceName(actuator.model_instance())}::{actuator.joint().name()}"
            for actuator in friction
        ]
        largest = np.array([actuator.effort_limit() for actuator in friction])
        recorder.constant("world/joints", np.array(joints))
        recorder.constant("world/coulomb", largest / (1.0 + self._world.joints.stribeck))
        recorder.constant("world/bodies", np.array(list(true)))
        masses = [(M.get_mass(), self._body(name).default_mass()) for name, M in true.items()]
        recorder.constant("world/masses", np.array(masses))
        if moved := self._world.kinematics.drawn:
            recorder.constant("world/frames", np.array(list(moved)))
            recorder.constant("world/frame_errors", np.array(list(moved.values())))

    def apply(self, context: Context) -> None:
        """Changes the plant's parameters in the context of the whole diagram."""
        own = self._plant.GetMyMutableContextFromRoot(context)
        for name, M in self._true_inertias().items():
            self._body(name).SetSpatialInertiaInBodyFrame(own, M)
        if self._world.joints.viscous != 1.0:
            for joint in self._joints():
                damping = self._world.joints.viscous * joint.default_damping_vector()
                joint.SetDampingVector(own, damping)
        frames = self._frames()
        for name, error in self._world.kinematics.drawn.items():
            X_FT = RigidTransform(RollPitchYaw(np.deg2rad(error[3:])), error[:3])
            frame = frames[name]
            frame.SetPoseInParentFrame(own, frame.GetPoseInParentFrame(own) @ X_FT)
        for delay, torques in self._delays:
            # The torques that a controller at rest has sent so far.
            sent = torques.Eval(torques.get_system().GetMyContextFromRoot(context))
            state = delay.GetMyMutableContextFromRoot(context).get_mutable_discrete_state_vector()
            state.SetFromVector(np.tile(sent, state.size() // len(sent)))

    def _true_inertias(self) -> Mapping[str, SpatialInertia]:
        """Returns the inertia of each body that differs from the controller's model, by name."""
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

    def _friction(self) -> Iterator[JointActuator]:
        """Yields the actuators that stand for friction."""
        if self._world.joints.coulomb:
            for index in self._plant.GetJointActuatorIndices():
                actuator = self._plant.get_joint_actuator(index)
                if actuator.has_controller():
                    yield actuator

    def _frames(self) -> dict[str, FixedOffsetFrame]:
        """Returns the frame of each of the arms' joints on the link before it.

        A joint in that link's own frame has none, and cannot be moved.
        """
        return {
            f"{self._plant.GetModelInstanceName(joint.model_instance())}::{joint.name()}": frame
            for joint in self._joints()
            if isinstance(frame := joint.frame_on_parent(), FixedOffsetFrame)
        }

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
