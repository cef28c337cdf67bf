"""A simulated arm behind the interface of a robot."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, MultibodyForces
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, InputPort

from geoimp_drake.robots.robot_arm import RobotStatus
from geoimp_drake.typing import Array

__all__ = ["PlantArm"]


class PlantArm:
    """The driver of an arm in a plant; see `RobotArm`. Time passes when a status is read.

    Its status has the joint torques of pushes and contacts. The weight of a payload is not among
    them, since whoever holds the arm knows it. Until the controller takes over, the arm rests, and
    its weight is held.

    Args:
        diagram: contains the plant, whose actuation of the arm is connected to its servos only.
        plant: in it, discrete.
        model_instance: the arm; its joints have the model's names.
        gravity: who holds the arm's weight, `controller` or `robot`.
        wrench: name of the diagram's output port with h at E, None for none.
        position: name of the diagram's input port with the positions of the arm's servos, in the
            plant's order; None if the arm takes torques.

    Attributes:
        simulator: of the diagram.
    """

    def __init__(
        self,
        diagram: Diagram,
        plant: MultibodyPlant,
        model_instance: ModelInstanceIndex,
        *,
        gravity: str = "controller",
        wrench: str | None = None,
        position: str | None = None,
    ):
        self.name = plant.GetModelInstanceName(model_instance)
        self.gravity, self.period, self.torque_rate = gravity, plant.time_step(), np.inf
        self._plant, self._arm = plant, model_instance
        # The robot's order is that of its actuators.
        actuators = map(plant.get_joint_actuator, plant.GetJointActuatorIndices(model_instance))
        joints = [a.joint() for a in sorted(actuators, key=lambda a: a.input_start())]
        self._own_joints = joints
        self.joints = tuple(joint.name() for joint in joints)
        self._q = [joint.position_start() for joint in joints]
        self._v = [joint.velocity_start() for joint in joints]
        self.real_time = False
        self.simulator = Simulator(diagram)
        self._context = plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        self._actuation = plant.get_actuation_input_port(model_instance)
        self._wrench = None if wrench is None else diagram.GetOutputPort(wrench)
        self._position = None if position is None else diagram.GetInputPort(position)
        self.takes = "torque" if position is None else "position"
        self._command = np.zeros(len(joints))

    def connect(self) -> RobotStatus:
        """See `RobotArm`."""
        # Until the controller takes over, something holds the arm's weight.
        if self._position is not None:
            self._command = self._plant.GetPositions(self._context)[self._q]
            self._send(self._position)
        else:
            is_held = self.gravity == "robot"
            self._command = np.zeros(len(self.joints)) if is_held else self._weight()
        return self._status()

    def start(self) -> None:
        """See `RobotArm`."""

    def read(self) -> RobotStatus:
        """See `RobotArm`; the plant moves on by a tick under the last command."""
        if self._position is not None:
            self._send(self._position)
        else:
            weight = self._weight() if self.gravity == "robot" else 0.0
            self._actuation.FixValue(self._context, self._command + weight)
        ticks = round(self.simulator.get_context().get_time() / self.period)
        self.simulator.AdvanceTo((ticks + 1) * self.period)
        return self._status()

    def write(self, command: Array) -> None:
        """See `RobotArm`."""
        self._command = command.copy()

    def stop(self) -> None:
        """See `RobotArm`."""

    def brake(self, is_held: bool) -> None:
        """Locks the joints, or releases them."""
        for joint in self._own_joints:
            if is_held:
                joint.Lock(self._context)
            else:
                joint.Unlock(self._context)

    def external_torque(self) -> Array:
        """Returns the joint torques of pushes and contacts, in the joints' order (n) [Nm, N]."""
        plant, context = self._plant, self._context
        forces, W = MultibodyForces(plant), plant.world_frame()
        pushes = plant.get_applied_spatial_force_input_port()
        for push in pushes.Eval(context) if pushes.HasValue(context) else ():
            body = plant.get_body(push.body_index)
            p_BoBq_W = plant.EvalBodyPoseInWorld(context, body).rotation() @ push.p_BoBq_B
            body.AddInForce(context, p_BoBq_W, push.F_Bq_W, W, forces)
        contact = np.zeros(plant.num_velocities())
        port = plant.get_generalized_contact_forces_output_port(self._arm)
        plant.SetVelocitiesInArray(self._arm, port.Eval(context), contact)
        external: Array = plant.CalcGeneralizedForces(context, forces) + contact
        return external[self._v]

    def _status(self) -> RobotStatus:
        q, v = self._plant.GetPositions(self._context), self._plant.GetVelocities(self._context)
        context = self.simulator.get_context()
        wrench = None if self._wrench is None else self._wrench.Eval(context).copy()
        external, torque = self.external_torque(), self._command
        if self._position is not None:
            weight = self._weight() if self.gravity == "robot" else 0.0
            torque = self._actuation.Eval(self._context) - weight
        return RobotStatus(context.get_time(), q[self._q], v[self._v], torque, wrench, external)

    def _send(self, position: InputPort) -> None:
        q = self._plant.GetPositions(self._context)
        q[self._q] = self._command
        own = self._plant.GetPositionsFromArray(self._arm, q)
        position.FixValue(self.simulator.get_mutable_context(), own)

    def _weight(self) -> Array:
        weight: Array = -self._plant.CalcGravityGeneralizedForces(self._context)[self._v]
        return weight
