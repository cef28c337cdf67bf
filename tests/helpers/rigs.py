"""Arms that are not ours under the controller, with wrist sensor and a push from outside."""

from dataclasses import dataclass

import numpy as np
from arms import ArmPlant, lock_fingers, make_arm_plant
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ExternallyAppliedSpatialForce,
)
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.state import ArmState, evaluate_arm
from geoimp_drake.controllers.config import ImpedanceControllerConfig, SamplingConfig
from geoimp_drake.controllers.impedance_config import ImpedanceConfig
from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.controllers.wrist_sensor import add_wrist_sensor
from geoimp_drake.parts.wrist_sensor_config import WristSensorConfig
from geoimp_drake.systems.frame_motion import frame_motion_at_rest
from geoimp_drake.systems.sensing.force_torque_sensor import ForceTorqueSensor

K_P = np.array([[900.0, 150.0, 0.0], [150.0, 700.0, 80.0], [0.0, 80.0, 1100.0]])
K_O = np.diag([12.0, 8.0, 10.0])


def quick_config(velocity: str = "measured") -> ImpedanceControllerConfig:
    """Returns an impedance that settles in a second; every other gain is the default's."""
    impedance = ImpedanceConfig()
    impedance.translation.damping = np.array(180.0)
    impedance.translation.stiffness = K_P
    impedance.rotation.damping = np.array(3.0)
    impedance.rotation.stiffness = K_O
    return ImpedanceControllerConfig(
        impedance=impedance, sampling=SamplingConfig(velocity=velocity), form="compiled"
    )


@dataclass
class ControlledArm:
    """A simulator of one controlled arm; D rests where E is in the arm's default posture."""

    rig: ArmPlant
    diagram: Diagram
    controller: Diagram
    sensor: ForceTorqueSensor
    simulator: Simulator
    X_WD: RigidTransform

    @property
    def context(self) -> Context:
        return self.simulator.get_mutable_context()

    @property
    def plant_context(self) -> Context:
        return self.rig.plant.GetMyMutableContextFromRoot(self.context)

    def read(self, port: str) -> np.ndarray:
        context = self.controller.GetMyContextFromRoot(self.context)
        return self.controller.GetOutputPort(port).Eval(context).copy()

    def wrench(self) -> np.ndarray:
        context = self.sensor.GetMyContextFromRoot(self.context)
        return self.sensor.GetOutputPort("wrench").Eval(context).copy()

    def pose(self) -> RigidTransform:
        return self.rig.E.CalcPoseInWorld(self.plant_context)

    def set_state(self, q: np.ndarray, v: np.ndarray) -> None:
        self.rig.plant.SetPositions(self.plant_context, self.rig.arm, q)
        self.rig.plant.SetVelocities(self.plant_context, self.rig.arm, v)

    def model(self) -> ControlModel:
        return ControlModel.of_arm(self.rig.plant, self.rig.arm, self.rig.E)

    def arm_state(self) -> ArmState:
        """Returns the arm's state as it is in the plant."""
        q = self.rig.plant.GetPositions(self.plant_context, self.rig.arm)
        return arm_state_at(
            self.model(), q, self.rig.plant.GetVelocities(self.plant_context, self.rig.arm)
        )

    def push(self, force: np.ndarray, moment: np.ndarray | None = None) -> None:
        """Lets the world push E's origin with a force and a moment in W from now on."""
        push = ExternallyAppliedSpatialForce()
        push.body_index = self.rig.E.body().index()
        push.p_BoBq_B = self.rig.E.GetFixedPoseInBodyFrame().translation()
        push.F_Bq_W = SpatialForce(np.zeros(3) if moment is None else moment, force)
        port = self.diagram.GetInputPort("push")
        port.FixValue(self.context, AbstractValue.Make([push]))


def make_controlled_arm(
    joints: int = 6,
    config: ImpedanceControllerConfig | None = None,
    *,
    X_DE: RigidTransform | None = None,
    sensor_config: WristSensorConfig | None = None,
    **options,
) -> ControlledArm:
    """Wires plant, wrist sensor and controller as a user would.

    Args:
        joints: six or seven.
        config: of the controller.
        X_DE: where D is from E at the start; equal to E by default.
        sensor_config: of the wrist sensor; ideal by default.
        options: of `make_arm_plant`.
    """
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    rig = make_arm_plant(plant, joints, **options)
    controller = builder.AddSystem(
        make_impedance_controller(plant, rig.arm, rig.E, config or quick_config())
    )
    sensor = add_wrist_sensor(builder, plant, rig.wrist, rig.E, sensor_config)
    builder.Connect(
        plant.get_state_output_port(rig.arm), controller.GetInputPort("estimated_state")
    )
    builder.Connect(sensor.GetOutputPort("wrench"), controller.GetInputPort("wrench"))
    builder.Connect(controller.GetOutputPort("actuation"), plant.get_actuation_input_port(rig.arm))
    _idle_others(builder, rig)
    builder.ExportInput(controller.GetInputPort("desired_motion"), "desired_motion")
    builder.ExportInput(plant.get_applied_spatial_force_input_port(), "push")
    diagram = builder.Build()
    simulator = Simulator(diagram)
    config = SimulatorConfig(
        integration_scheme="runge_kutta2", max_step_size=1e-3, use_error_control=False
    )
    ApplySimulatorConfig(config, simulator)
    arm = ControlledArm(rig, diagram, controller, sensor, simulator, RigidTransform())
    if options.get("company"):
        lock_fingers(rig, arm.plant_context)
    arm.X_WD = arm.pose() @ (X_DE or RigidTransform()).inverse()
    port = diagram.GetInputPort("desired_motion")
    port.FixValue(arm.context, frame_motion_at_rest(arm.X_WD))
    return arm


def _idle_others(builder: DiagramBuilder, rig: ArmPlant) -> None:
    """Gives every other arm no torque, and no weight."""
    plant = rig.plant
    if not plant.HasModelInstanceNamed("other"):
        return
    other = plant.GetModelInstanceByName("other")
    nothing = builder.AddSystem(ConstantVectorSource(np.zeros(plant.num_actuated_dofs(other))))
    builder.Connect(nothing.get_output_port(), plant.get_actuation_input_port(other))


def arm_state_at(model: ControlModel, q: np.ndarray, v: np.ndarray) -> ArmState:
    state = np.concatenate((q, v))[model.state_order]
    return evaluate_arm(model, model.plant.CreateDefaultContext(), state)


def law_torque(model: ControlModel, arm: ArmState, a: np.ndarray, h: np.ndarray) -> np.ndarray:
    """Returns (2.3) with (2.5), or with (3.32) to (3.38) for β = 0 and K_n = 10 B, once more.

    The derivative of the pseudo-inverse is a difference along the arm's velocity.
    """
    B_inverse = np.linalg.inv(arm.B)

    def pseudo_inverse(q: np.ndarray) -> np.ndarray:
        at = arm_state_at(model, q, arm.v)
        weighted = np.linalg.inv(at.B) @ at.Jv_V_WE.T
        return weighted @ np.linalg.inv(at.Jv_V_WE @ weighted)

    def coriolis(v: np.ndarray) -> np.ndarray:
        return arm_state_at(model, arm.q, v).Cv

    J, J_pinv, step = arm.Jv_V_WE, pseudo_inverse(arm.q), 1e-5
    dJ_pinv = pseudo_inverse(arm.q + step * arm.v) - pseudo_inverse(arm.q - step * arm.v)
    N = np.eye(len(arm.q)) - J_pinv @ J
    e = -N @ arm.v
    C_e = 0.5 * (coriolis(arm.v + e) - coriolis(arm.v) - coriolis(e))
    alpha = J_pinv @ (a - arm.Jdot_v)
    if len(arm.q) > 6:
        alpha = alpha + N @ (dJ_pinv / (2 * step) @ J @ arm.v + 10.0 * e + B_inverse @ C_e)
    return arm.B @ alpha + arm.Cv + arm.Fv + arm.g + J.T @ h
