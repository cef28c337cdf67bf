"""A loaded robot, found a start posture for, is a six-DOF spring when its hand is pressed."""

import numpy as np
import pytest
from pressed_hand import press
from published_arms import RosArm, write_mjcf, write_sdf
from pydrake.math import RigidTransform, RollPitchYaw

import geoimp_drake
from geoimp_drake.controllers.impedance_config import ImpedanceConfig

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
    file = write(tmp_path)

    def load(plant):
        return geoimp_drake.load_robot(
            file,
            plant,
            end_effector=end_effector,
            offset=RigidTransform(RollPitchYaw(0.1, 0.4, 0.2), [0.1, 0.02, 0.0]),
            base_pose=RigidTransform(RollPitchYaw(0.1, 0.2, 1.0), [0.2, 0.1, 0.0]),
            geometry="leave-out",
        )

    pressed = press(load, stiff(), FORCE, 1.2)
    expected = np.linalg.solve(K_P, FORCE)
    moved = pressed.X_WE.translation() - pressed.X_WD.translation()
    error = np.linalg.norm(moved - expected) / np.linalg.norm(expected)
    print(f"\n{name}: {error:.2%} from the inverse stiffness")
    assert error < 0.01
    np.testing.assert_allclose(pressed.wrench[3:], -FORCE, atol=0.05)
