"""A loaded robot, found a start posture for, is a six-DOF spring when its hand is pressed."""

import numpy as np
import pytest
from published_arms import RosArm, write_mjcf, write_sdf
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ExternallyAppliedSpatialForce
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

import geoimp_drake
from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.config import ImpedanceConfig
from geoimp_drake.systems.frame_motion import frame_motion_at_rest

K_P = np.array([[900.0, 150.0, 0.0], [150.0, 700.0, 80.0], [0.0, 80.0, 1100.0]])
FORCE = np.array([20.0, -10.0, 15.0])
ROBOTS = {
    "urdf with a gripper": (RosArm(gripper=True).write, "tool0"),
    "urdf that ends in its last link": (RosArm(tool=False).write, "link_6"),
    "sdf": (write_sdf, "tcp"),
    "mjcf": (write_mjcf, "tcp"),
}


def stiff() -> geoimp_drake.ImpedanceControllerConfig:
    impedance = ImpedanceConfig()
    impedance.translation.damping = np.array(180.0)
    impedance.translation.stiffness = K_P
    impedance.rotation.damping = np.array(3.0)
    impedance.rotation.stiffness = np.array(10.0)
    return geoimp_drake.ImpedanceControllerConfig(impedance=impedance)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_press_displaces_the_hand_by_the_inverse_stiffness(tmp_path, name):
    write, end_effector = ROBOTS[name]
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    robot = geoimp_drake.load_robot(
        write(tmp_path),
        plant,
        end_effector=end_effector,
        offset=RigidTransform(RollPitchYaw(0.1, 0.4, 0.2), [0.1, 0.02, 0.0]),
        base_pose=RigidTransform(RollPitchYaw(0.1, 0.2, 1.0), [0.2, 0.1, 0.0]),
        geometry="leave-out",
    )
    plant.Finalize()
    arm, E = robot.model_instance, robot.end_effector_frame
    model = ControlModel.of_arm(plant, arm, E)
    start = np.zeros(6)
    start[model.state_order[:6]] = geoimp_drake.find_start_posture(model)
    plant.SetDefaultPositions(arm, start)
    controller = builder.AddSystem(geoimp_drake.make_impedance_controller(plant, arm, E, stiff()))
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
    diagram.GetInputPort("push").FixValue(context, AbstractValue.Make([_push(E)]))
    simulator.AdvanceTo(1.2)

    moved = E.CalcPoseInWorld(plant.GetMyContextFromRoot(context)).translation()
    expected = np.linalg.solve(K_P, FORCE)
    error = np.linalg.norm(moved - X_WD.translation() - expected) / np.linalg.norm(expected)
    print(f"\n{name}: {error:.2%} from the inverse stiffness")
    assert error < 0.01
    wrench = sensor.GetOutputPort("wrench").Eval(sensor.GetMyContextFromRoot(context))
    np.testing.assert_allclose(wrench[3:], -FORCE, atol=0.05)


def _push(E) -> ExternallyAppliedSpatialForce:
    push = ExternallyAppliedSpatialForce()
    push.body_index = E.body().index()
    push.p_BoBq_B = E.GetFixedPoseInBodyFrame().translation()
    push.F_Bq_W = SpatialForce(np.zeros(3), FORCE)
    return push
