"""Start postures that are found: within limits, regular, where they shall be, always the same."""

import numpy as np
import pytest
from published_arms import RosArm
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.start_posture import find_start_posture, limit_margin
from geoimp_drake.arm.state import evaluate_arm
from geoimp_drake.errors import ConfigurationError, SingularityError
from geoimp_drake.robot_files.loading import load_robot

X_WE = RigidTransform(RollPitchYaw(2.9, 0.3, -0.4), [0.55, 0.1, 0.45])


def model_of(folder, **options) -> ControlModel:
    plant = MultibodyPlant(1e-3)
    file = RosArm(**options).write(folder)
    robot = load_robot(file, plant, end_effector="tool0", geometry="leave-out")
    plant.Finalize()
    return ControlModel.of_arm(plant, robot.model_instance, robot.end_effector_frame)


def smallest_singular_value(model: ControlModel, q: np.ndarray) -> float:
    context = model.plant.CreateDefaultContext()
    arm = evaluate_arm(model, context, np.concatenate((q, np.zeros_like(q))))
    return float(np.linalg.svd(arm.Jv_V_WE, compute_uv=False)[-1])


def test_anywhere_is_far_from_limits_and_singularities(tmp_path):
    model = model_of(tmp_path)
    q = find_start_posture(model)
    random = np.random.default_rng(7).uniform(-2.9, 2.9, (200, 6))
    sigmas = [smallest_singular_value(model, other) for other in random]
    assert smallest_singular_value(model, q) > np.quantile(sigmas, 0.95)
    assert limit_margin(model, q) > 0.25


def test_a_pose_is_reached_within_the_limits_by_the_best_of_several_postures(tmp_path):
    model = model_of(tmp_path)
    q = find_start_posture(model, X_WE)
    context = model.plant.CreateDefaultContext()
    model.plant.SetPositions(context, q)
    reached = model.end_effector.CalcPoseInWorld(context)
    np.testing.assert_allclose(reached.GetAsMatrix4(), X_WE.GetAsMatrix4(), atol=1e-5)
    assert limit_margin(model, q) > 0.05
    assert smallest_singular_value(model, q) > 0.05


def test_the_same_seed_gives_the_same_posture(tmp_path):
    model = model_of(tmp_path)
    for pose in (None, X_WE):
        first, second = (find_start_posture(model, pose, seed=3) for _ in range(2))
        np.testing.assert_array_equal(first, second)
    assert not np.array_equal(find_start_posture(model), find_start_posture(model, seed=1))


def test_joints_without_limits_do_not_count_and_stay_within_a_turn(tmp_path):
    model = model_of(tmp_path, limits={1: "", 6: '<limit effort="1" lower="-0.1" upper="0.3"/>'})
    q = find_start_posture(model)
    assert abs(q[0]) <= np.pi
    assert -0.1 < q[5] < 0.3
    middle = np.zeros(6)
    middle[5] = 0.1
    assert limit_margin(model, middle) == pytest.approx(1.0)
    middle[0] = 50.0
    assert limit_margin(model, middle) == pytest.approx(1.0)
    middle[5] = 0.3
    assert limit_margin(model, middle) == pytest.approx(0.0)


def test_a_pose_out_of_reach_is_refused_with_its_numbers(tmp_path):
    with pytest.raises(ConfigurationError, match=r"3\.0, 0\.0, 1\.0.*within reach"):
        find_start_posture(model_of(tmp_path), RigidTransform([3.0, 0.0, 1.0]))


def test_an_arm_that_is_always_singular_is_refused(tmp_path):
    limit = '<limit effort="9" lower="-1e-4" upper="1e-4" velocity="1"/>'
    model = model_of(tmp_path, limits=dict.fromkeys(range(1, 7), limit))
    with pytest.raises(SingularityError, match="smallest singular value"):
        find_start_posture(model)


def test_a_posture_on_a_joint_limit_is_no_start(tmp_path):
    """The only way to the pose has joint 1 on its limit, as far as a solver can tell."""
    q = np.array([0.4, 0.3, 0.9, 0.5, -0.9, 0.3])
    lowest, highest = q - 0.05, q + 0.05
    lowest[0], highest[0] = q[0] - 2.0, q[0]
    limits = {
        k + 1: f'<limit effort="9" lower="{lowest[k]}" upper="{highest[k]}" velocity="1"/>'
        for k in range(6)
    }
    model = model_of(tmp_path, limits=limits)
    context = model.plant.CreateDefaultContext()
    model.plant.SetPositions(context, q)
    with pytest.raises(ConfigurationError, match="No posture within the joint limits"):
        find_start_posture(model, model.end_effector.CalcPoseInWorld(context))
