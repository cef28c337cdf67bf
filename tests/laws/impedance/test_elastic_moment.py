"""The elastic moment is the gradient of its potential, (3.19), (3.20), (3.29)–(3.31)."""

import numpy as np
import pytest
from law_numerics import (
    LARGEST_ANGLE,
    assert_close,
    every_family,
    geometric_families,
    moments,
    random_family,
    random_rotvec,
    random_spd,
    rate_of_change,
    rotation_gradient,
)

from geoimp_drake.laws.impedance import angle_axis_impedance, quaternion_impedance
from geoimp_drake.laws.impedance.families import make_family
from geoimp_drake.rotations import angle_axis, quaternion

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


@geometric_families
def test_moment_is_the_gradient_of_the_potential(name):
    rng = np.random.default_rng(1)
    for moment in moments(50):
        family = random_family(name, rng)
        Q_WC = moment.Q_WC
        gradient = rotation_gradient(
            lambda Q_CD, f=family, Q=Q_WC: f.potential_energy(quaternion.product(Q, Q_CD), Q),
            quaternion.relative(Q_WC, moment.Q_WD),
        )
        computed = family.elastic_moment(*moment.attitudes())
        assert_close(computed, gradient, atol=1e-8 * np.abs(gradient).max())


def test_gradient_by_differences_tells_the_naive_moment_from_the_right_one():
    rng = np.random.default_rng(2)
    K_o = random_spd(rng, 1.0, 10.0)
    Q_CD = quaternion.exp(random_rotvec(rng))
    gradient = rotation_gradient(lambda Q: quaternion_impedance.potential_energy(Q, K_o), Q_CD)
    naive = 2.0 * K_o @ Q_CD[1:]  # equal to first order, but without Eᵀ
    assert np.abs(naive - gradient).max() > 0.1


@every_family
def test_rate_of_the_potential_is_the_moment_times_its_dual_velocity(name):
    rng = np.random.default_rng(3)
    for moment in moments(50):
        family = random_family(name, rng)
        rate = rate_of_change(
            lambda t, f=family, m=moment: f.potential_energy(*m.after(t).attitudes())
        )
        power = family.elastic_moment(*moment.attitudes()) @ family.dual_velocity(*moment.motion())
        assert power == pytest.approx(rate, rel=1e-6, abs=1e-7)


@every_family
def test_moment_in_W_holds_the_spring_as_C_turns_and_D_rests(name):
    rng = np.random.default_rng(4)
    for moment in moments(50):
        family = random_family(name, rng)
        moment.w_WD = moment.dw_WD = np.zeros(3)
        rate = rate_of_change(
            lambda t, f=family, m=moment: f.potential_energy(*m.after(t).attitudes())
        )
        power = -moment.w_WC @ family.elastic_moment_W(*moment.attitudes())
        assert power == pytest.approx(rate, rel=1e-6, abs=1e-7)
        generalized = family.generalized_moment(
            *moment.attitudes(), family.elastic_moment_W(*moment.attitudes())
        )
        assert_close(generalized, family.elastic_moment(*moment.attitudes()), atol=1e-11)


def orientation_loop(t):
    """A closed curve of relative orientations, within 83°."""
    turn = np.array([0.9 * np.cos(t), 0.9 * np.sin(t), 0.6 * np.cos(2.0 * t + 0.5)])
    return quaternion.exp(turn + np.array([0.2, 0.1, 0.0]))


def work_round_the_loop(moment_of, steps=400):
    """∮ᶜμᵀΔᶜω dt [J]; the trapezoidal rule is exact to rounding on a smooth closed curve."""
    work = 0.0
    for t in 2.0 * np.pi * np.arange(steps) / steps:
        Q = orientation_loop(t)
        Q_dot = rate_of_change(lambda d, t=t: orientation_loop(t + d))
        w_CD_C = 2.0 * quaternion.product(Q_dot, quaternion.conjugate(Q))[1:]
        work += moment_of(Q) @ w_CD_C
    return work * 2.0 * np.pi / steps


@geometric_families
@pytest.mark.parametrize("seed", [0, 1])
def test_work_round_a_closed_loop_is_zero(name, seed):
    K_o = random_spd(np.random.default_rng(seed), 1.0, 10.0)
    family = make_family(name, np.eye(3), np.eye(3), K_o)
    work = work_round_the_loop(lambda Q: family.elastic_moment(Q, IDENTITY))
    assert abs(work) < 1e-5


@pytest.mark.parametrize("row", angle_axis.REPRESENTATIONS.values(), ids=lambda row: row.name)
def test_stiffness_times_displacement_alone_makes_joules_a_lap(row):
    K_o = np.diag([4.0, 10.0, 2.5])
    work = work_round_the_loop(lambda Q: K_o @ angle_axis.displacement(row, Q))
    print(f"work of K_o·o a lap, f = {row.name}: {work:.2f} J")
    assert abs(work) > 1.0


@geometric_families
def test_stiffness_times_displacement_is_the_moment(name):
    K_o = random_spd(np.random.default_rng(5), 1.0, 10.0)
    family = make_family(name, np.eye(3), np.eye(3), K_o)
    for moment in moments(20):
        Q_CD = quaternion.relative(moment.Q_WC, moment.Q_WD)
        x = family.displacement(*moment.attitudes())
        stiffness = (
            quaternion_impedance.rotational_stiffness(Q_CD, K_o)
            if name == "quaternion"
            else angle_axis_impedance.rotational_stiffness(
                angle_axis.omega(family.row, Q_CD), K_o, family.psi
            )
        )
        assert_close(stiffness @ x, family.elastic_moment(*moment.attitudes()), atol=1e-12)


def test_sine_half_family_is_the_quaternion_family():
    rng = np.random.default_rng(6)
    for moment in moments(100, largest=3.1):
        gains = random_spd(rng, 0.2, 0.6), random_spd(rng, 1.0, 4.0), random_spd(rng, 1.0, 10.0)
        one, other = make_family("quaternion", *gains), make_family("angle-axis-sin-half", *gains)
        assert_close(
            one.angular_acceleration(*moment.law_input()),
            other.angular_acceleration(*moment.law_input()),
            atol=1e-12,
        )
        assert_close(
            one.elastic_moment(*moment.attitudes()),
            other.elastic_moment(*moment.attitudes()),
            atol=1e-12,
        )
        np.testing.assert_array_equal(
            one.displacement(*moment.attitudes()), other.displacement(*moment.attitudes())
        )
        assert one.potential_energy(*moment.attitudes()) == pytest.approx(
            other.potential_energy(*moment.attitudes()), abs=1e-12
        )


MOMENT_ALONG_AN_AXIS = {
    "quaternion": np.sin,
    "angle-axis-sin": lambda theta: 0.5 * np.sin(2.0 * theta),
    "angle-axis-sin-half": np.sin,
    "angle-axis-tan-half": lambda theta: 2.0 * np.tan(theta / 2.0) / np.cos(theta / 2.0) ** 2,
    "angle-axis-simple": lambda theta: theta,
}


@geometric_families
def test_displacement_along_a_principal_axis_gives_a_moment_along_it(name):
    rng = np.random.default_rng(7)
    for moment in moments(20):
        K_o = random_spd(rng, 1.0, 10.0)
        family = make_family(name, np.eye(3), np.eye(3), K_o)
        for gamma, u in zip(*_axes(K_o), strict=True):
            theta = rng.uniform(-LARGEST_ANGLE, LARGEST_ANGLE)
            Q_WD = quaternion.product(moment.Q_WC, quaternion.exp(theta * u))
            expected = gamma * MOMENT_ALONG_AN_AXIS[name](theta) * u
            computed = family.elastic_moment(Q_WD, moment.Q_WC)
            assert_close(computed, expected, atol=1e-11)


def test_alternative_euler_keeps_the_axis_of_a_diagonal_stiffness_only():
    gamma = np.array([4.0, 1.0, 2.5])
    U, _ = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))
    for i, theta in [(0, 0.6), (1, -0.6), (2, 0.6)]:
        aligned = _moment_about("alternative-euler", np.diag(gamma), theta * np.eye(3)[i])
        assert_close(aligned, gamma[i] * theta * np.eye(3)[i], atol=1e-12)  # (3.10)
        tilted = _moment_about("alternative-euler", (U * gamma) @ U.T, theta * U[:, i])
        off_axis = np.linalg.norm(np.cross(U[:, i], tilted))
        print(f"alternative Euler, nondiagonal K_o: {off_axis:.3f} Nm off axis {i}")
        assert off_axis > 0.05


def _moment_about(name, K_o, rotvec):
    family = make_family(name, np.eye(3), np.eye(3), K_o)
    return family.elastic_moment_W(quaternion.exp(rotvec), IDENTITY)


def _axes(K_o):
    gamma, U = np.linalg.eigh(K_o)
    return gamma, U.T
