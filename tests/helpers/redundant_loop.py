"""The arm on the track under impedance control, with its wrist sensor and without a surface."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.config import ImpedanceControllerConfig, SamplingConfig
from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.controllers.wrist_sensor import add_wrist_sensor
from geoimp_drake.diagrams.scene.cell import END_EFFECTOR, SEVEN, WRIST_SENSOR, add_cell
from geoimp_drake.parts.wrist_sensor_config import WristSensorConfig
from geoimp_drake.systems.sources.desired_motion import DesiredMotion, MotionSegment


@dataclass
class Loop:
    """A simulator of the closed loop."""

    plant: MultibodyPlant
    model: ControlModel
    simulator: Simulator

    def joint(self, name: str) -> float:
        return float(self.state()[self.model.joint_names.index(name)])

    def state(self) -> np.ndarray:
        """Returns [q; v] in the order of the control model."""
        context = self.plant.GetMyContextFromRoot(self.simulator.get_context())
        return self.plant.GetPositionsAndVelocities(context)[self.model.state_order]

    def end_effector(self) -> RigidTransform:
        context = self.plant.GetMyContextFromRoot(self.simulator.get_context())
        return self.plant.GetFrameByName(END_EFFECTOR).CalcPoseInWorld(context)

    def null_space_output(self, port: str) -> np.ndarray:
        """Returns an output port of the null-space motion over time."""
        controller = self.simulator.get_system().GetSubsystemByName("seven_impedance_controller")
        context = controller.GetMyContextFromRoot(self.simulator.get_context())
        return controller.GetOutputPort(port).Eval(context).copy()

    def sample(self, duration: float, period: float, read: Callable[[], object]) -> np.ndarray:
        """Returns what `read` gives now and after every period."""
        rows = [read()]
        begin = self.simulator.get_context().get_time()
        for k in range(round(duration / period)):
            self.simulator.AdvanceTo(begin + (k + 1) * period)
            rows.append(read())
        return np.array(rows)


def closed_loop(
    posture: np.ndarray,
    config: ImpedanceControllerConfig | None = None,
    *,
    segments: tuple[MotionSegment, ...] = (),
    step: float = 1e-3,
    velocity: np.ndarray | None = None,
    sensor: WristSensorConfig | None = None,
) -> Loop:
    """Returns the initialized loop; D starts on E.

    Args:
        posture: joint positions at the start (7).
        config: of the controller; its sampling period becomes the step.
        segments: D's motion.
        step: of plant, sensor and controller [s].
        velocity: joint velocities at the start (7).
        sensor: its errors; none by default.
    """
    config = config or ImpedanceControllerConfig()
    sensor = sensor or WristSensorConfig()
    config.sampling = SamplingConfig(step, config.sampling.velocity)
    builder = DiagramBuilder()
    plant = builder.AddNamedSystem("plant", MultibodyPlant(step))
    instances = add_cell(plant, "track_arm")
    plant.Finalize()
    arm = instances[SEVEN]
    E = plant.GetFrameByName(END_EFFECTOR)
    model = ControlModel.of_arm(plant, arm, E)
    plant.SetDefaultPositions(arm, posture)
    X_WE = E.CalcPoseInWorld(plant.CreateDefaultContext())
    desired = builder.AddNamedSystem("desired_motion", DesiredMotion(X_WE, segments))
    controller = builder.AddSystem(make_impedance_controller(plant, arm, E, config))
    weld = plant.GetJointByName(WRIST_SENSOR)
    wrist = add_wrist_sensor(builder, plant, weld, E, replace(sensor, period=step))
    for output, target in (
        (desired.GetOutputPort("motion"), controller.GetInputPort("desired_motion")),
        (plant.get_state_output_port(arm), controller.GetInputPort("estimated_state")),
        (wrist.GetOutputPort("wrench"), controller.GetInputPort("wrench")),
        (controller.GetOutputPort("actuation"), plant.get_actuation_input_port(arm)),
        (controller.GetOutputPort("compliant_motion"), wrist.GetInputPort("reference_motion")),
    ):
        builder.Connect(output, target)
    simulator = Simulator(builder.Build())
    if velocity is not None:
        context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        plant.SetVelocities(context, arm, velocity)
    ApplySimulatorConfig(
        SimulatorConfig(
            integration_scheme="runge_kutta2", max_step_size=step, use_error_control=False
        ),
        simulator,
    )
    simulator.Initialize()
    return Loop(plant, model, simulator)
