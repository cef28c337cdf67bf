"""A robot from a file in closed loop, found a start posture for, whose hand is pressed."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ExternallyAppliedSpatialForce,
    MultibodyPlant,
)
from pydrake.multibody.tree import Frame
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

import geoimp_drake
from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.robot_files.loading import LoadedRobot
from geoimp_drake.systems.frame_motion import POSITION, frame_motion_at_rest


@dataclass(frozen=True)
class PressedHand:
    """What there is at the end: D, E and C in W, the measured wrench, the actuation."""

    robot: LoadedRobot
    X_WD: RigidTransform
    X_WE: RigidTransform
    p_WC: np.ndarray
    wrench: np.ndarray
    actuation: np.ndarray


def press(
    load: Callable[[MultibodyPlant], LoadedRobot],
    config: geoimp_drake.ImpedanceControllerConfig,
    force: np.ndarray,
    duration: float,
) -> PressedHand:
    """Holds the start pose for a time with an ideal sensor; the force is on E, in W."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    robot = load(plant)
    plant.Finalize()
    arm, E = robot.model_instance, robot.end_effector_frame
    model = ControlModel.of_arm(plant, arm, E)
    start = model.in_plant_order(geoimp_drake.find_start_posture(model))
    plant.SetDefaultPositions(arm, start)
    controller = builder.AddSystem(geoimp_drake.make_impedance_controller(plant, arm, E, config))
    ideal = geoimp_drake.WristSensorConfig(inertial_load="plant")
    sensor = geoimp_drake.add_wrist_sensor(builder, plant, robot.sensor_joint, E, ideal)
    builder.Connect(plant.get_state_output_port(arm), controller.GetInputPort("estimated_state"))
    builder.Connect(sensor.GetOutputPort("wrench"), controller.GetInputPort("wrench"))
    builder.Connect(controller.GetOutputPort("actuation"), plant.get_actuation_input_port(arm))
    builder.ExportInput(controller.GetInputPort("desired_motion"), "desired_motion")
    builder.ExportInput(plant.get_applied_spatial_force_input_port(), "push")
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    X_WD = E.CalcPoseInWorld(plant.GetMyContextFromRoot(context))
    diagram.GetInputPort("desired_motion").FixValue(context, frame_motion_at_rest(X_WD))
    diagram.GetInputPort("push").FixValue(context, AbstractValue.Make([_push(E, force)]))
    simulator.AdvanceTo(duration)

    def output(system, port: str) -> np.ndarray:
        return system.GetOutputPort(port).Eval(system.GetMyContextFromRoot(context))

    return PressedHand(
        robot,
        X_WD,
        E.CalcPoseInWorld(plant.GetMyContextFromRoot(context)),
        output(controller, "compliant_motion")[POSITION],
        output(sensor, "wrench"),
        output(controller, "actuation"),
    )


def _push(E: Frame, force: np.ndarray) -> ExternallyAppliedSpatialForce:
    push = ExternallyAppliedSpatialForce()
    push.body_index = E.body().index()
    push.p_BoBq_B = E.GetFixedPoseInBodyFrame().translation()
    push.F_Bq_W = SpatialForce(np.zeros(3), force)
    return push
