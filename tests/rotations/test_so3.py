import numpy as np
import pytest
from rotation_numerics import assert_close, random_unit_quaternions, rotation_vectors
from scipy.spatial.transform import Rotation

from geoimp_drake.rotations import quaternion, so3

A, B = np.array([0.3, -1.2, 2.0]), np.array([-0.7, 0.4, 1.1])


def test_skew_and_cross_are_the_vector_product():
    assert_close(so3.skew(A) @ B, np.cross(A, B), atol=1e-15)
    assert_close(so3.cross(A, B), np.cross(A, B), atol=1e-15)


def test_vee_inverts_skew():
    np.testing.assert_array_equal(so3.vee(so3.skew(A)), A)


# The series end at 0.01 rad for exp and at 0.02 rad for log.
ANGLES = [0.0, 1e-9, 1e-3, 0.0099, 0.0101, 0.0199, 0.0201, 1.0, 3.0, np.pi - 1e-9]


@pytest.mark.parametrize("angle", ANGLES)
def test_log_inverts_exp_from_zero_to_a_half_turn(angle):
    for axis in rotation_vectors(20, 1.0):
        rotvec = angle * axis / np.linalg.norm(axis)
        assert_close(so3.log(so3.exp(rotvec)), rotvec, atol=3e-15)


def test_exp_agrees_with_scipy():
    for rotvec in rotation_vectors(50, 3.0):
        assert_close(so3.exp(rotvec), Rotation.from_rotvec(rotvec).as_matrix(), atol=1e-14)


@pytest.mark.parametrize(
    ("rotation", "axis"),
    [
        (so3.x_rotation, [1.0, 0.0, 0.0]),
        (so3.y_rotation, [0.0, 1.0, 0.0]),
        (so3.z_rotation, [0.0, 0.0, 1.0]),
    ],
)
def test_elementary_rotations_turn_about_their_axes(rotation, axis):
    expected = Rotation.from_rotvec(0.7 * np.array(axis)).as_matrix()
    assert_close(rotation(0.7), expected, atol=1e-15)
    assert_close(so3.rotation_about(np.array(axis), 0.7), expected, atol=1e-15)


def test_is_rotation_accepts_rotations_only():
    R = quaternion.to_rotation(random_unit_quaternions(1)[0])
    assert so3.is_rotation(R)
    assert not so3.is_rotation(1.001 * R)
    assert not so3.is_rotation(-R)
    assert not so3.is_rotation(np.full((3, 3), np.nan))
    assert not so3.is_rotation(np.eye(2))
