import numpy as np
import pytest
from rotation_numerics import (
    assert_close,
    random_unit_quaternions,
    rate_of_change,
    rotation_vectors,
)
from scipy.spatial.transform import Rotation

from geoimp_drake.errors import SignalError
from geoimp_drake.rotations import quaternion, so3

ATTITUDES = random_unit_quaternions(200)


def near_half_turns():
    return [
        np.array([eta, *(np.sqrt(1.0 - eta * eta) * v / np.linalg.norm(v))])
        for v in [*np.eye(3), *-np.eye(3), *rotation_vectors(20, 1.0)]
        for eta in (0.0, 1e-12, 1e-8, 1e-4)
    ]


def test_rotation_matrix_agrees_with_scipy():
    for Q in ATTITUDES:
        expected = Rotation.from_quat(np.roll(Q, -1)).as_matrix()
        assert_close(quaternion.to_rotation(Q), expected, atol=1e-14)


def test_round_trip_through_the_matrix_is_exact_everywhere():
    for Q in [*ATTITUDES, *near_half_turns()]:
        R = quaternion.to_rotation(Q)
        back = quaternion.from_rotation(R)
        assert back[0] >= 0.0
        assert abs(abs(back @ Q) - 1.0) < 1e-14
        assert_close(quaternion.to_rotation(back), R, atol=2e-15)


def test_product_is_the_product_of_rotations():
    for A, B in zip(ATTITUDES, ATTITUDES[::-1], strict=True):
        R = quaternion.to_rotation(A) @ quaternion.to_rotation(B)
        assert_close(quaternion.to_rotation(quaternion.product(A, B)), R, atol=1e-14)


def test_relative_is_the_short_way_from_the_first_frame_to_the_second():
    for C, D in zip(ATTITUDES, ATTITUDES[::-1], strict=True):
        Q_CD = quaternion.relative(C, D)
        product = quaternion.product(quaternion.conjugate(C), D)
        assert_close(Q_CD, quaternion.canonical(product), atol=1e-15)
        assert Q_CD[0] >= 0.0
        np.testing.assert_array_equal(quaternion.relative(-C, D), Q_CD)


def test_the_two_quaternions_of_a_rotation_have_one_canonical_form():
    for Q in ATTITUDES:
        np.testing.assert_array_equal(quaternion.canonical(Q), quaternion.canonical(-Q))


def test_rate_is_the_derivative_for_an_angular_velocity_in_the_base_frame():
    for Q, w in zip(ATTITUDES, rotation_vectors(200, 3.0), strict=True):
        Q_dot = rate_of_change(lambda t, w=w, Q=Q: quaternion.product(quaternion.exp(w * t), Q))
        assert_close(quaternion.rate(Q, w), Q_dot, atol=1e-9)
        assert_close(quaternion.rate(Q, w)[0], -0.5 * Q[1:] @ w, atol=1e-15)
        assert_close(quaternion.rate(Q, w)[1:], 0.5 * quaternion.E(Q) @ w, atol=1e-15)


def test_rate_in_body_is_the_derivative_for_an_angular_velocity_in_the_body():
    for Q, w in zip(ATTITUDES, rotation_vectors(200, 3.0), strict=True):
        Q_dot = rate_of_change(lambda t, w=w, Q=Q: quaternion.product(Q, quaternion.exp(w * t)))
        assert_close(quaternion.rate_in_body(Q, w), Q_dot, atol=1e-9)


def test_E_is_eta_minus_skew():
    for Q in ATTITUDES:
        expected = Q[0] * np.eye(3) - so3.skew(Q[1:])
        np.testing.assert_array_equal(quaternion.E(Q), expected)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 0.00999, 0.01001, 0.3, 3.1])
def test_log_inverts_exp(angle):
    for axis in rotation_vectors(10, 1.0):
        axis /= np.linalg.norm(axis)
        Q = quaternion.exp(angle * axis)
        assert abs(Q @ Q - 1.0) < 1e-15
        assert_close(Q, quaternion.from_axis_angle(axis, angle), atol=1e-15)
        assert_close(quaternion.log(Q), angle * axis, atol=2e-15)


def test_check_unit_names_the_signal_and_gives_the_norm():
    quaternion.check_unit(ATTITUDES[0], "Q_WD")
    with pytest.raises(SignalError, match=r"Q_WD.*norm is 1\.001"):
        quaternion.check_unit(1.001 * ATTITUDES[0], "Q_WD")
    with pytest.raises(SignalError, match="nan"):
        quaternion.check_unit(np.full(4, np.nan), "Q_WD")
