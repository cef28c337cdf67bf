import numpy as np
import pytest
from rotation_numerics import assert_close, rate_of_change, rotation_vectors

from geoimp_drake.errors import ConfigurationError, OutOfDomainError
from geoimp_drake.rotations import angle_axis, quaternion, so3

ROWS = list(angle_axis.REPRESENTATIONS.values())
every_row = pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)


def omega_as_printed(row, theta, r):
    f, projector = row.f(theta), np.outer(r, r)
    across = 0.5 * f / np.tan(0.5 * theta) * (np.eye(3) - projector)
    return row.f_prime(theta) * projector + across - 0.5 * so3.skew(f * r)


@every_row
def test_f_prime_is_the_derivative_of_f_and_positive_up_to_its_limit(row):
    for theta in np.linspace(0.0, 0.99 * row.theta_max, 30):
        slope = rate_of_change(lambda d, theta=theta: row.f(theta + d))
        np.testing.assert_allclose(row.f_prime(theta), slope, rtol=1e-6)
        assert slope > 0.0
    assert row.f_prime(0.0) == row.f_prime_at_zero
    assert row.f(0.0) == 0.0


@every_row
def test_displacement_is_f_times_the_axis(row):
    for rotvec in rotation_vectors(100, 0.99 * row.theta_max):
        theta = np.linalg.norm(rotvec)
        o = angle_axis.displacement(row, quaternion.exp(rotvec))
        np.testing.assert_allclose(o, row.f(theta) * rotvec / theta, rtol=1e-11)


@every_row
def test_omega_is_the_printed_matrix(row):
    for rotvec in rotation_vectors(100, 0.99 * row.theta_max):
        theta = np.linalg.norm(rotvec)
        printed = omega_as_printed(row, theta, rotvec / theta)
        scale = np.abs(printed).max()
        computed = angle_axis.omega(row, quaternion.exp(rotvec))
        assert_close(computed, printed, atol=1e-11 * scale)


@every_row
@pytest.mark.parametrize("fraction", [1e-7, 0.003, 0.0063, 0.0064, 0.3, 0.9])
def test_omega_gives_the_rate_of_the_displacement(row, fraction):
    vectors = rotation_vectors(40, 1.0)
    for direction, w in zip(vectors[:20], vectors[20:], strict=True):
        rotvec = fraction * row.theta_max * direction / np.linalg.norm(direction)
        Q = quaternion.exp(rotvec)
        o_dot = rate_of_change(
            lambda t, w=w, Q=Q: angle_axis.displacement(
                row, quaternion.product(quaternion.exp(w * t), Q)
            )
        )
        assert_close(
            angle_axis.displacement_rate(row, Q, w), o_dot, atol=2e-7 * np.abs(o_dot).max()
        )


@every_row
def test_omega_at_zero_is_f_prime_times_the_identity(row):
    Omega = angle_axis.omega(row, np.array([1.0, 0.0, 0.0, 0.0]))
    assert_close(Omega, row.f_prime_at_zero * np.eye(3), atol=1e-15)


def test_series_and_closed_form_of_the_simple_rotation_meet():
    row = angle_axis.REPRESENTATIONS["simple"]
    for s2 in (0.99e-4, 1.01e-4):
        s = np.sqrt(s2)
        Q = np.array([np.sqrt(1.0 - s2), s, 0.0, 0.0])
        printed = omega_as_printed(row, 2.0 * np.arcsin(s), np.array([1.0, 0.0, 0.0]))
        assert_close(angle_axis.omega(row, Q), printed, atol=3e-15)


@every_row
def test_the_end_of_the_domain_is_reported_with_the_angle(row):
    inside, outside = row.theta_max - 0.003, row.theta_max - 0.001 * (row.theta_max > 3.0)
    axis = np.array([0.6, 0.0, 0.8])
    angle_axis.check_domain(row, quaternion.from_axis_angle(axis, inside))
    with pytest.raises(OutOfDomainError, match=rf"{row.name}.*{np.degrees(outside):.2f}°"):
        angle_axis.check_domain(row, quaternion.from_axis_angle(axis, outside + 1e-9))


def test_unknown_function_is_refused_with_the_valid_names():
    assert angle_axis.representation("tan-half").name == "tan-half"
    with pytest.raises(ConfigurationError, match="sin, sin-half, tan-half, simple"):
        angle_axis.representation("cosine")
