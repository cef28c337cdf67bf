"""d(kinetic + potential)/dt = supplied power − dissipated power along simulated motion."""

import numpy as np
import pytest
from law_numerics import every_family, moments, random_family, random_spd

from geoimp_drake.laws.impedance import translational_impedance
from geoimp_drake.rotations import quaternion


def desired_w(t):
    w = np.array([0.5 * np.sin(t), 0.3 * np.cos(2.0 * t), 0.4 * np.sin(1.3 * t)])
    dw = np.array([0.5 * np.cos(t), -0.6 * np.sin(2.0 * t), 0.52 * np.cos(1.3 * t)])
    return w, dw


def external_moment(t):
    return np.array([0.8 * np.sin(3.0 * t), 0.5 * np.cos(2.0 * t), 0.6 * np.sin(t)])


def runge_kutta(rate, x, duration, steps=300):
    h = duration / steps
    for t in h * np.arange(steps):
        k1 = rate(t, x)
        k2 = rate(t + 0.5 * h, x + 0.5 * h * k1)
        k3 = rate(t + 0.5 * h, x + 0.5 * h * k2)
        k4 = rate(t + h, x + h * k3)
        x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return x


def rotational_balance(family, moment, law=None, duration=1.5):
    """Energy at the end − at the start − supplied + dissipated [J], and the work supplied."""
    law = law or family.angular_acceleration

    def rate(t, x):
        Q_WD, Q_WC, w_WC = x[:4], x[4:8], x[8:11]
        (w_WD, dw_WD), mu_W = desired_w(t), external_moment(t)
        motion = Q_WD, w_WD, Q_WC, w_WC
        supplied = family.supplied_power(*motion, mu_W)
        return np.concatenate(
            [
                quaternion.rate(Q_WD, w_WD),
                quaternion.rate(Q_WC, w_WC),
                law(Q_WD, w_WD, dw_WD, Q_WC, w_WC, mu_W),
                [supplied - family.dissipated_power(*motion), abs(supplied)],
            ]
        )

    def energy(t, x):
        motion = x[:4], desired_w(t)[0], x[4:8], x[8:11]
        return family.kinetic_energy(*motion) + family.potential_energy(x[:4], x[4:8])

    start = np.concatenate([moment.Q_WD, moment.Q_WC, moment.w_WC, [0.0, 0.0]])
    end = runge_kutta(rate, start, duration)
    return energy(duration, end) - energy(0.0, start) - end[11], end[12]


@every_family
def test_rotational_energy_balances(name):
    rng = np.random.default_rng(1)
    for moment in moments(2, seed=5, largest=0.6):
        moment.w_WC = desired_w(0.0)[0] + 0.3 * moment.w_WC
        error, work = rotational_balance(random_family(name, rng), moment)
        assert work > 0.05
        assert abs(error) < 1e-7


def test_balance_fails_for_a_spring_that_is_no_gradient():
    family = random_family("quaternion", np.random.default_rng(1))
    moment = moments(1, seed=5, largest=0.6)[0]

    def without_E(Q_WD, w_WD, dw_WD, Q_WC, w_WC, mu_W):
        R_WC = quaternion.to_rotation(Q_WC)
        surplus = family.elastic_moment(Q_WD, Q_WC)
        surplus = surplus - 2.0 * family.K_o @ family.displacement(Q_WD, Q_WC)
        return family.angular_acceleration(Q_WD, w_WD, dw_WD, Q_WC, w_WC, mu_W + R_WC @ surplus)

    error, _ = rotational_balance(family, moment, without_E)
    assert abs(error) > 1e-4  # a thousand times the bound above


@every_family
def test_powers_are_those_of_the_dual_velocity(name):
    rng = np.random.default_rng(2)
    for moment in moments(20):
        family = random_family(name, rng)
        x_dot = family.dual_velocity(*moment.motion())
        supplied = family.generalized_moment(*moment.attitudes(), moment.mu_W) @ x_dot
        assert family.supplied_power(*moment.motion(), moment.mu_W) == pytest.approx(supplied)
        assert family.dissipated_power(*moment.motion()) == pytest.approx(
            x_dot @ family.D_o @ x_dot
        )
        assert family.dissipated_power(*moment.motion()) > 0.0


@pytest.mark.parametrize(
    ("name", "dual"), [("quaternion", True), ("angle-axis-sin", True), ("classical-euler", False)]
)
def test_moment_is_dual_to_the_relative_angular_velocity(name, dual):
    rng = np.random.default_rng(3)
    for moment in moments(20):
        family = random_family(name, rng)
        power = moment.mu_W @ (moment.w_WD - moment.w_WC)
        same = family.supplied_power(*moment.motion(), moment.mu_W) == pytest.approx(power)
        assert same == dual


def test_translational_energy_balances():
    rng = np.random.default_rng(4)
    M, D, K = random_spd(rng, 5.0, 20.0), random_spd(rng, 50.0, 200.0), random_spd(rng, 300.0, 900)
    M_inv = np.linalg.inv(M)

    def desired(t):
        s, c = np.sin(2.0 * t), np.cos(2.0 * t)
        a = np.array([0.05, -0.03, 0.02])
        return a * s, 2.0 * a * c, -4.0 * a * s

    def differences(t, x):
        p_d, v_d, _ = desired(t)
        return p_d - x[:3], v_d - x[3:6]

    def rate(t, x):
        dp, dv = differences(t, x)
        f = np.array([20.0 * np.sin(5.0 * t), 10.0, 5.0 * np.cos(t)])
        net = translational_impedance.supplied_power(dv, f)
        net = net - translational_impedance.dissipated_power(dv, D)
        ddp = translational_impedance.compliant_acceleration(desired(t)[2], dv, dp, f, M_inv, D, K)
        return np.concatenate([x[3:6], ddp, [net]])

    def energy(t, x):
        dp, dv = differences(t, x)
        kinetic = translational_impedance.kinetic_energy(dv, M)
        return kinetic + translational_impedance.potential_energy(dp, K)

    start = np.concatenate([[0.02, 0.0, -0.01], np.zeros(3), [0.0]])
    end = runge_kutta(rate, start, 1.5)
    assert energy(0.0, start) > 0.1
    assert abs(energy(1.5, end) - energy(0.0, start) - end[6]) < 1e-7
