"""Integral action and friction fed forward do what they say, compiled and as written."""

import numpy as np
import pytest

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.motion_control.friction_compensation import (
    followed_velocity,
    friction_torque,
)
from geoimp_drake.laws.motion_control.integral_action import integral_torque, integrated_error

rng = np.random.default_rng(3)


@pytest.mark.parametrize("n", [6, 7])
def test_the_integral_accelerates_the_hand_and_nothing_else(n):
    J, root = rng.normal(size=(6, n)), rng.normal(size=(n, n))
    B, gains, error_sum = root @ root.T + np.eye(n), rng.uniform(1.0, 9.0, 6), rng.normal(size=6)
    torque = integral_torque(B, np.linalg.pinv(J), gains, error_sum)
    np.testing.assert_allclose(J @ np.linalg.solve(B, torque), gains * error_sum, atol=1e-10)
    same = compiled(integral_torque)(B, np.linalg.pinv(J), gains, error_sum)
    np.testing.assert_allclose(same, torque, rtol=1e-12)


def test_the_integral_ends_at_its_bound():
    error = np.array([1.0, -1.0, 0.1, 0.0, 2.0, -0.3])
    for law in (integrated_error, compiled(integrated_error)):
        total = np.zeros(6)
        for _ in range(100):
            total = law(total, error, 0.01, 0.2)
        np.testing.assert_allclose(total, [0.2, -0.2, 0.1, 0.0, 0.2, -0.2], atol=1e-12)


def test_joints_that_follow_move_the_hand_as_it_is_asked_to():
    J, v, V = rng.normal(size=(6, 7)), rng.normal(size=7), rng.normal(size=6)
    followed = followed_velocity(np.linalg.pinv(J), v, J @ v, V)
    np.testing.assert_allclose(J @ followed, V, atol=1e-12)
    _, _, Vt = np.linalg.svd(J)
    np.testing.assert_allclose(Vt[6] @ followed, Vt[6] @ v, atol=1e-12)


def test_friction_is_odd_and_saturates():
    v, coulomb, viscous = np.array([0.5, -0.5, 0.0]), np.full(3, 4.0), np.full(3, 2.0)
    for law in (friction_torque, compiled(friction_torque)):
        np.testing.assert_allclose(law(v, coulomb, viscous, 0.01), [5.0, -5.0, 0.0], atol=1e-9)
    slow = friction_torque(np.full(3, 1e-3), coulomb, 0.0 * viscous, 0.01)
    np.testing.assert_allclose(slow, 0.4, rtol=1e-2)
