"""Values go by the names of joints, whatever order robot, plant and actuators have."""

from dataclasses import replace

import numpy as np
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.robot_joints import RobotJoints
from geoimp_drake.models import model_path
from geoimp_drake.robot_files.loading import load_robot

# As with transmissions that a file names in another order than its joints.
STATE, ACTUATION = np.array([2, 0, 5, 1, 4, 3]), np.array([3, 5, 0, 1, 4, 2])
ROBOT = [4, 2, 0, 1, 5, 3]


def shuffled_model() -> ControlModel:
    plant = MultibodyPlant(0.0)
    file = model_path("six_joint_arm")
    robot = load_robot(file, plant, end_effector="flange", geometry="leave-out")
    plant.Finalize()
    model = ControlModel.of_arm(plant, robot.model_instance, robot.end_effector_frame)
    return replace(model, state_order=np.concatenate((STATE, 6 + STATE)), actuation_order=ACTUATION)


def test_torques_go_by_name():
    model = shuffled_model()
    joints = RobotJoints(model, [model.joint_names[k] for k in ROBOT])
    driven = {model.joint_names[k]: 10.0 * a for a, k in enumerate(ACTUATION)}
    torques = joints.torques(10.0 * np.arange(6))
    assert dict(zip(joints.names, torques, strict=True)) == driven
    np.testing.assert_array_equal(joints.actuation(torques), 10.0 * np.arange(6))


def test_readings_go_by_name():
    model = shuffled_model()
    joints = RobotJoints(model, [model.joint_names[k] for k in ROBOT])
    q, v = np.arange(6.0), 100.0 + np.arange(6.0)
    reading = joints.reading(q, v)
    for k, name in enumerate(model.joint_names):
        place = joints.names.index(name)
        assert (reading[STATE[k]], reading[6 + STATE[k]]) == (q[place], v[place])
        assert joints.from_base(q)[k] == q[place]
