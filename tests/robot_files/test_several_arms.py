"""A robot with two arms in one file: each becomes an arm with a model instance of its own."""

from pathlib import Path

import numpy as np
import pytest
from published_arms import EFFORTS, RosArm, write_dual_mjcf, write_dual_urdf
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError, ModelError
from geoimp_drake.robot_files.loading import EndEffector, LoadedRobot, load_robot

X_WB = RigidTransform(RollPitchYaw(0.2, -0.1, 0.7), [0.3, -0.5, 0.2])
FILES = {
    "urdf": (write_dual_urdf, ["left_tool0", "right_tool0"], "torso_yaw"),
    "mjcf": (write_dual_mjcf, ["left_link_6", "right_link_6"], "lift"),
}
JOINTS = [f"joint_{k}" for k in range(1, 7)]


def loaded(file: Path, end_effectors, **options) -> tuple[MultibodyPlant, tuple[LoadedRobot, ...]]:
    plant = MultibodyPlant(1e-3)
    robots = load_robot(file, plant, end_effectors=end_effectors, name="dual", **options)
    plant.Finalize()
    return plant, robots


@pytest.mark.parametrize("kind", FILES)
def test_each_arm_has_its_joints_and_ports_and_the_shared_joint_is_locked(kind, tmp_path) -> None:
    write, hands, shared = FILES[kind]
    plant, robots = loaded(write(tmp_path), hands)
    for robot, hand in zip(robots, hands, strict=True):
        arm, side = robot.model_instance, hand.split("_")[0]
        assert plant.GetModelInstanceName(arm) == f"dual_{hand}"
        assert plant.get_state_output_port(arm).size() == 12
        assert plant.get_actuation_input_port(arm).size() == 6
        model = ControlModel.of_arm(plant, arm, robot.end_effector_frame)
        assert list(model.joint_names) == [f"{side}_{joint}" for joint in JOINTS]
        np.testing.assert_array_equal(model.effort_limits, EFFORTS)
    assert plant.num_velocities() == 12
    assert f"joints that move several arms locked: {shared}" in robots[0].changes
    assert robots[0].sensor_joint.name() != robots[1].sensor_joint.name()


@pytest.mark.parametrize("kind", FILES)
def test_an_arm_of_two_moves_as_the_one_that_is_loaded_alone(kind, tmp_path) -> None:
    """Alone it has the torso's joint, too; at rest there it is the same arm."""
    write, hands, _ = FILES[kind]
    file = write(tmp_path)
    plant, robots = loaded(file, hands, base_pose=X_WB)
    alone = MultibodyPlant(1e-3)
    one = load_robot(file, alone, end_effector=hands[1], base_pose=X_WB)
    alone.Finalize()
    q, both, single = np.linspace(0.1, 0.9, 6), plant.CreateDefaultContext(), None
    plant.SetPositions(both, robots[1].model_instance, q)
    single = alone.CreateDefaultContext()
    alone.SetPositions(single, one.model_instance, np.append(0.0, q))
    X_WE = robots[1].end_effector_frame.CalcPoseInWorld(both)
    expected = one.end_effector_frame.CalcPoseInWorld(single)
    np.testing.assert_allclose(X_WE.GetAsMatrix34(), expected.GetAsMatrix34(), atol=1e-12)
    models = [
        ControlModel.of_arm(plant, robots[1].model_instance, robots[1].end_effector_frame),
        ControlModel.of_arm(alone, one.model_instance, one.end_effector_frame),
    ]
    B = []
    for model, posture in zip(models, (q, np.append(0.0, q)), strict=True):
        context = model.plant.CreateDefaultContext()
        model.plant.SetPositions(context, posture)
        B.append(model.plant.CalcMassMatrix(context))
    np.testing.assert_allclose(B[0], B[1][1:, 1:], rtol=1e-9)


def test_an_end_effector_may_have_its_offset_and_its_sensor(tmp_path) -> None:
    offset = RigidTransform([0.0, 0.0, 0.1])
    hands = [EndEffector("left_tool0", offset, "left_to_tool0"), "right_tool0"]
    _, (left, right) = loaded(write_dual_urdf(tmp_path), hands)
    assert left.sensor_joint.name() == "left_to_tool0"
    X_FE = left.end_effector_frame.GetFixedPoseInBodyFrame()
    np.testing.assert_array_equal(X_FE.translation(), [0.0, 0.0, 0.1])
    assert right.end_effector_frame.name() == "right_tool0"


def test_a_robot_with_one_arm_may_be_given_as_a_list(tmp_path) -> None:
    file = RosArm(visual='<box size="1 1 1"/>', collision='<box size="1 1 1"/>').write(tmp_path)
    _, robots = loaded(file, ["tool0"])
    assert len(robots) == 1


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"end_effectors": ["left_tool0", "left_link_6"]}, ModelError, "0 joints (none) move"),
        ({"end_effectors": ["left_tool0"] * 2}, ModelError, "'left_tool0' and no other"),
        ({"end_effectors": ["left_tool0", "rigth"]}, ModelError, "right_tool0"),
        ({"end_effectors": []}, ConfigurationError, "end_effectors is []"),
        (
            {"end_effector": "left_tool0", "end_effectors": ["left_tool0"]},
            ConfigurationError,
            "end_effector is 'left_tool0'",
        ),
        (
            {"end_effectors": ["left_tool0", "right_tool0"], "sensor_joint": "left_to_tool0"},
            ConfigurationError,
            "EndEffector",
        ),
    ],
)
def test_what_cannot_be_is_named_and_the_plant_is_left(options, error, words, tmp_path) -> None:
    plant = MultibodyPlant(1e-3)
    with pytest.raises(error) as caught:
        load_robot(write_dual_urdf(tmp_path), plant, **options)
    assert words in str(caught.value)
    assert plant.num_model_instances() == 2
