import numpy as np
import pytest
from rotation_numerics import (
    assert_close,
    random_unit_quaternions,
    rate_of_change,
    rotation_vectors,
)
from scipy.spatial.transform import Rotation

from geoimp_drake.errors import SingularityError
from geoimp_drake.rotations import euler, quaternion, so3

ATTITUDES = [quaternion.to_rotation(Q) for Q in random_unit_quaternions(100)]
ANGLES = [euler.from_rotation(R) for R in ATTITUDES]
RATES = rotation_vectors(100, 3.0)


def test_angles_are_those_of_successive_rotations_about_x_y_z():
    for phi, R in zip(ANGLES, ATTITUDES, strict=True):
        a, b, c = phi
        assert_close(so3.x_rotation(a) @ so3.y_rotation(b) @ so3.z_rotation(c), R, atol=1e-14)
        assert_close(euler.to_rotation(phi), R, atol=1e-14)
        assert_close(phi, Rotation.from_matrix(R).as_euler("XYZ"), atol=1e-11)


def test_T_gives_the_angular_velocity_in_the_base_frame():
    for phi, phi_dot in zip(ANGLES, RATES, strict=True):
        R_dot = rate_of_change(lambda t, p=phi, d=phi_dot: euler.to_rotation(p + d * t))
        w = so3.vee(R_dot @ euler.to_rotation(phi).T)
        assert_close(euler.T(phi) @ phi_dot, w, atol=1e-8)


def test_T_dot_is_the_derivative_of_T():
    for phi, phi_dot in zip(ANGLES, RATES, strict=True):
        T_dot = rate_of_change(lambda t, p=phi, d=phi_dot: euler.T(p + d * t))
        assert_close(euler.T_dot(phi, phi_dot), T_dot, atol=1e-8)


def test_T_inverse_and_the_condition_number_are_those_of_T():
    for phi in ANGLES:
        T = euler.T(phi)
        assert_close(euler.T_inverse(phi) @ T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(euler.condition_number(phi), np.linalg.cond(T), rtol=1e-10)


def test_T_is_the_identity_at_zero():
    np.testing.assert_array_equal(euler.T(np.zeros(3)), np.eye(3))


def test_rates_give_back_angular_velocity_and_acceleration():
    for phi, w, dw in zip(ANGLES, RATES, RATES[::-1], strict=True):
        phi_dot, ddphi = euler.rates(phi, w, dw)
        assert_close(euler.T(phi) @ phi_dot, w, atol=1e-11)
        assert_close(euler.T(phi) @ ddphi + euler.T_dot(phi, phi_dot) @ phi_dot, dw, atol=1e-9)


@pytest.mark.parametrize("turns", [-2, -1, 0, 1, 2])
def test_wrapped_differences_lie_within_a_half_turn(turns):
    dphi = np.array([0.3, -3.0, np.pi])
    assert_close(euler.wrapped(dphi + 2.0 * np.pi * turns), dphi, atol=1e-14)


def test_wrapped_difference_is_small_across_the_jump_of_an_angle():
    before = euler.from_rotation(so3.x_rotation(np.pi - 0.01))
    after = euler.from_rotation(so3.x_rotation(np.pi + 0.01))
    assert_close(euler.wrapped(after - before), [0.02, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_singularity_is_reported_with_its_number(sign):
    euler.check_regular(np.array([0.2, sign * (np.pi / 2 - 1.1e-3), 0.4]))
    with pytest.raises(SingularityError, match=r"D in W.*\|cos pitch\| is 0\.0009,"):
        euler.check_regular(np.array([0.2, sign * (np.pi / 2 - 9e-4), 0.4]), "D in W")
    with pytest.raises(SingularityError):
        euler.check_regular(np.full(3, np.nan))
