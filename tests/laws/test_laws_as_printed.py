"""Each law, written out as the chapter prints it, holds along the motion that it causes.

The angles and their derivatives come from scipy and finite differences, not from the library.
"""

import numpy as np
import pytest
from law_numerics import (
    GEOMETRIC,
    acceleration_of,
    assert_close,
    moments,
    random_family,
    rate_of_change,
)
from scipy.spatial.transform import Rotation

from geoimp_drake.laws.impedance import angle_axis_impedance, compliant_rotation
from geoimp_drake.laws.motion_control.inverse_dynamics import inverse_dynamics
from geoimp_drake.laws.motion_control.orientation_control import (
    ERROR_PER_ANGLE,
    ORIENTATION_LAWS,
    orientation_law,
)
from geoimp_drake.laws.motion_control.position_control import position_acceleration
from geoimp_drake.laws.motion_control.quaternion_control import orientation_error
from geoimp_drake.laws.motion_control.resolved_acceleration import resolved_acceleration
from geoimp_drake.rotations import euler, quaternion

K_D, K_P = 13.0 * np.eye(3), 40.0 * np.eye(3)
COUPLED_D = np.array([[13.0, 1.0, 0.0], [1.0, 9.0, -2.0], [0.0, -2.0, 11.0]])


def angles(Q):
    return Rotation.from_quat(np.roll(Q, -1)).as_euler("XYZ")


def classical(moment):
    return euler.wrapped(angles(moment.Q_WD) - angles(moment.Q_WC))


def alternative(moment):
    return angles(quaternion.relative(moment.Q_WC, moment.Q_WD))


def rates_of(coordinates, moment):
    """x, ẋ and ẍ of coordinates along the motion, by finite differences."""
    at = lambda t: coordinates(moment.after(t))  # noqa: E731 - used twice, one line
    return at(0.0), rate_of_change(at), acceleration_of(at)


def jacobian_of_angles(Q):
    """T by differences: its columns are the angular velocities of the unit rates."""
    phi = angles(Q)
    columns = []
    for e in np.eye(3):
        turned = lambda d, e=e: Rotation.from_euler("XYZ", phi + d * e).as_matrix()  # noqa: E731
        S = rate_of_change(turned) @ turned(0.0).T
        columns.append([S[2, 1], S[0, 2], S[1, 0]])
    return np.array(columns).T


@pytest.mark.parametrize(
    ("name", "coordinates"), [("classical-euler", classical), ("alternative-euler", alternative)]
)
def test_euler_impedances_obey_their_law(name, coordinates):
    rng = np.random.default_rng(0)
    for moment in moments(30, seed=1, largest=1.2):
        family = random_family(name, rng)
        moment.dw_WC = family.angular_acceleration(*moment.law_input())
        x, x_dot, ddx = rates_of(coordinates, moment)
        if name == "classical-euler":
            m = jacobian_of_angles(moment.Q_WC).T @ moment.mu_W  # (3.3)
        else:
            T = jacobian_of_angles(quaternion.relative(moment.Q_WC, moment.Q_WD))
            m = T.T @ quaternion.to_rotation(moment.Q_WC).T @ moment.mu_W  # (3.6)
        left = family.M_o @ ddx + family.D_o @ x_dot + family.K_o @ x
        assert_close(left, m, atol=1e-5 * max(1.0, np.abs(ddx).max()))
        assert_close(family.displacement(*moment.attitudes()), x, atol=1e-11)
        assert_close(family.dual_velocity(*moment.motion()), x_dot, atol=1e-6)


@pytest.mark.parametrize("name", GEOMETRIC)
def test_geometric_impedances_obey_their_law(name):
    rng = np.random.default_rng(1)
    for moment in moments(30, seed=2):
        family = random_family(name, rng)
        moment.dw_WC = family.angular_acceleration(*moment.law_input())

        def relative_w(t, m=moment):
            later = m.after(t)
            return quaternion.to_rotation(later.Q_WC).T @ (later.w_WD - later.w_WC)

        w_CD_C, dw_CD_C = relative_w(0.0), rate_of_change(relative_w)
        terms = [
            angle_axis_impedance.inertial_moment(dw_CD_C, family.M_o),  # (3.18)
            angle_axis_impedance.damping_moment(w_CD_C, family.D_o),  # (3.21)
            family.elastic_moment(*moment.attitudes()),  # (3.20)
        ]
        mu_C = quaternion.to_rotation(moment.Q_WC).T @ moment.mu_W
        assert_close(sum(terms), mu_C, atol=1e-7 * np.abs(dw_CD_C).max())


def test_relative_and_compliant_angular_velocity_are_inverse():
    for moment in moments(5):
        R_WC = quaternion.to_rotation(moment.Q_WC)
        w_CD_C = compliant_rotation.relative_angular_velocity(R_WC, moment.w_WD, moment.w_WC)
        back = compliant_rotation.angular_velocity(moment.w_WD, R_WC, w_CD_C)
        assert_close(back, moment.w_WC, atol=1e-14)


def controlled(name, moment, D=K_D):
    """The instant with E (in C's place) accelerated by the orientation law `name`."""
    moment.dw_WC = orientation_law(name)(*moment.law_input()[:5], D, K_P)
    return moment


@pytest.mark.parametrize(
    ("name", "coordinates"), [("classical-euler", classical), ("alternative-euler", alternative)]
)
def test_euler_control_makes_the_angles_obey_a_linear_equation(name, coordinates):
    for moment in moments(30, seed=3, largest=1.2):
        x, x_dot, ddx = rates_of(coordinates, controlled(name, moment, COUPLED_D))
        left = ddx + COUPLED_D @ x_dot + K_P @ x  # (2.10), (2.12)
        assert_close(left, 0.0, atol=1e-5 * max(1.0, np.abs(ddx).max()))


INTEGRAL_OF_F = {
    "quaternion": lambda theta: 2.0 * (1.0 - np.cos(0.5 * theta)),
    "angle-axis-sin": lambda theta: 1.0 - np.cos(theta),
    "angle-axis-sin-half": lambda theta: 2.0 * (1.0 - np.cos(0.5 * theta)),
    "angle-axis-tan-half": lambda theta: -2.0 * np.log(np.cos(0.5 * theta)),
    "angle-axis-simple": lambda theta: 0.5 * theta**2,
}


@pytest.mark.parametrize("name", GEOMETRIC)
def test_geometric_control_dissipates_its_lyapunov_function(name):
    """V = k_P ∫f dϑ + ½‖Δω‖² has V̇ = −k_D‖Δω‖²: this proves (2.13), (2.15) asymptotic."""
    for moment in moments(30, seed=4):
        controlled(name, moment)

        def V(t, m=moment):
            later = m.after(t)
            R_WE, R_WD = (quaternion.to_rotation(Q) for Q in (later.Q_WC, later.Q_WD))
            theta = np.linalg.norm(Rotation.from_matrix(R_WE.T @ R_WD).as_rotvec())
            dw = later.w_WD - later.w_WC
            return 40.0 * INTEGRAL_OF_F[name](theta) + 0.5 * dw @ dw

        dw = moment.w_WD - moment.w_WC
        assert rate_of_change(V) == pytest.approx(-13.0 * dw @ dw, rel=1e-6, abs=1e-6)


def test_quaternion_error_points_from_E_to_D():
    for moment in moments(10):
        rotvec = Rotation.from_quat(
            np.roll(quaternion.relative(moment.Q_WC, moment.Q_WD), -1)
        ).as_rotvec()
        theta = np.linalg.norm(rotvec)
        expected = np.sin(0.5 * theta) * rotvec / theta  # (2.14)
        assert_close(orientation_error(*moment.attitudes()), expected, atol=1e-12)


def test_position_error_obeys_a_linear_equation():
    rng = np.random.default_rng(5)
    ddp_d, dp, p = rng.normal(size=(3, 3))
    ddp_error = ddp_d - position_acceleration(ddp_d, dp, p, COUPLED_D, K_P)
    assert_close(ddp_error + COUPLED_D @ dp + K_P @ p, 0.0, atol=1e-13)


@pytest.mark.parametrize("n", [6, 7])
def test_inverse_dynamics_gives_the_joints_the_acceleration_asked_for(n):
    rng = np.random.default_rng(6)
    B = rng.normal(size=(n, n))
    B = B @ B.T + np.eye(n)
    alpha, Cv, Fv, g = rng.normal(size=(4, n))
    J, h = rng.normal(size=(6, n)), rng.normal(size=6)
    tau = inverse_dynamics(B, alpha, Cv, Fv, g, J, h)
    ddq = np.linalg.solve(B, tau - J.T @ h - Cv - Fv - g)  # (2.2)
    assert_close(ddq, alpha, atol=1e-12)
    at_rest = inverse_dynamics(B, np.zeros(n), np.zeros(n), np.zeros(n), g, J, np.zeros(6))
    np.testing.assert_array_equal(at_rest, g)


def test_resolved_acceleration_gives_the_end_effector_the_one_asked_for():
    rng = np.random.default_rng(7)
    J, Jdot_v, a = rng.normal(size=(6, 6)), rng.normal(size=6), rng.normal(size=6)
    alpha = resolved_acceleration(J, Jdot_v, a)
    assert_close(J @ alpha + Jdot_v, a, atol=1e-12)


@pytest.mark.parametrize("name", ORIENTATION_LAWS)
def test_error_of_a_small_angle_is_the_part_of_it_that_is_listed(name) -> None:
    still, small, K = np.zeros(3), 1e-5 * np.array([0.5, -0.7, 0.4]), np.eye(3)
    Q_WE = quaternion.exp(np.array([0.3, 0.2, -0.1]))
    Q_WD = quaternion.product(quaternion.exp(small), Q_WE)
    a = orientation_law(name)(Q_WD, still, still, Q_WE, still, K, K)
    np.testing.assert_allclose(a, ERROR_PER_ANGLE[name] * small, rtol=1e-3)
