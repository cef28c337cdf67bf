"""The program of the limits, its box, and what holds C back."""

import numpy as np
import pytest

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.limits.acceleration_box import acceleration_box, limits_bind
from geoimp_drake.laws.limits.constrained_acceleration import constrained_acceleration
from geoimp_drake.laws.limits.held_back import held_back
from geoimp_drake.parts.quadratic_program import minimum

SETTINGS = np.array([0.02, 0.3, 0.01, 0.01, 10.0, 0.0])  # T, braking, σ₀, λ₀, k, ρ


def spd(rng, n: int) -> np.ndarray:
    A = rng.normal(size=(n, n))
    return A @ A.T + n * np.eye(n)


def limits(n: int, velocity: float = 2.0, effort: float = np.inf) -> np.ndarray:
    ones = np.ones(n)
    return np.array([-3 * ones, 3 * ones, -velocity * ones, velocity * ones, effort * ones])


def solved(J, b, B, c, x, alpha_0, W, kept, settings=SETTINGS):
    problem = constrained_acceleration(J, b, B, c, x, alpha_0, W, kept, settings)
    fast = compiled(constrained_acceleration)(J, b, B, c, x, alpha_0, W, kept, settings)
    for written, found in zip(problem, fast, strict=True):
        np.testing.assert_allclose(found, written, rtol=1e-12, atol=1e-12)
    H, f, lower, upper = problem
    return minimum(H, f, B, lower, upper), lower, upper


@pytest.mark.parametrize("seed", range(5))
def test_slack_is_the_acceleration_by_a_wrench_of_constraint(seed) -> None:
    """JᵀWs, the wrench of constraint on the joints, has entries at bound joints only."""
    rng = np.random.default_rng(seed)
    J, B, W, b = rng.normal(size=(6, 6)), spd(rng, 6), spd(rng, 6), 300 * rng.normal(size=6)
    x = 0.2 * rng.normal(size=12)
    alpha, lower, upper = solved(J, b, B, np.zeros(6), x, np.zeros(6), W, limits(6))
    bound = np.isclose(alpha, lower[:6]) | np.isclose(alpha, upper[:6])
    assert 0 < bound.sum() < 6
    forces = J.T @ W @ (J @ alpha - b)
    assert np.abs(forces[~bound]).max() < 1e-6 * np.abs(forces).max()
    # And it holds the joints inside: it pushes up at lower bounds and down at upper ones.
    assert (forces[np.isclose(alpha, lower[:6])] >= 0).all()
    assert (forces[np.isclose(alpha, upper[:6])] <= 0).all()


def test_only_the_lost_direction_is_damped() -> None:
    rng = np.random.default_rng(3)
    U, _, Vt = np.linalg.svd(rng.normal(size=(6, 6)))
    b, x = rng.normal(size=6), np.concatenate((np.zeros(6), 0.1 * rng.normal(size=6)))
    for sigma in (0.0, 0.004):
        J = (U * [2.0, 1.5, 1.0, 0.5, 0.2, sigma]) @ Vt
        alpha, *_ = solved(J, b, np.eye(6), np.zeros(6), x, np.zeros(6), np.eye(6), limits(6))
        np.testing.assert_allclose(U.T[:5] @ (J @ alpha - b), 0.0, atol=1e-9)
        damping = 1e-4 * (1 - (sigma / 0.01) ** 2)
        asked = sigma * (U[:, 5] @ b) - 10.0 * damping * (Vt[5] @ x[6:])
        assert Vt[5] @ alpha == pytest.approx(asked / (sigma**2 + damping), rel=1e-6)


def test_spare_joints_follow_their_null_space_motion() -> None:
    rng = np.random.default_rng(4)
    J, B = rng.normal(size=(6, 7)), spd(rng, 7)
    alpha_0 = rng.normal(size=7)
    settings = SETTINGS.copy()
    settings[5] = 1e-6
    found, *_ = solved(
        J, J @ alpha_0, B, np.zeros(7), np.zeros(14), alpha_0, np.eye(6), limits(7), settings
    )
    np.testing.assert_allclose(found, alpha_0, atol=1e-6)


@pytest.mark.parametrize("effort", [np.inf, 40.0])
def test_efforts_are_kept_even_where_that_leaves_the_box(effort) -> None:
    rng = np.random.default_rng(5)
    J, B, c = rng.normal(size=(6, 6)), spd(rng, 6), 5 * rng.normal(size=6)
    x = np.concatenate((np.zeros(6), [2.9, -1.0, 0.0, 0.0, 0.0, 0.0]))  # faster than allowed
    alpha, lower, upper = solved(
        J, rng.normal(size=6), B, c, x, np.zeros(6), np.eye(6), limits(6, effort=effort)
    )
    assert (np.abs(B @ alpha + c) <= effort + 1e-6).all()
    inside = (lower[:6] - 1e-6 <= alpha) & (alpha <= upper[:6] + 1e-6)
    assert inside.all() == np.isinf(effort)


@pytest.mark.parametrize("seed", range(4))
def test_a_joint_in_the_box_never_passes_its_end(seed) -> None:
    rng = np.random.default_rng(seed)
    kept, B = limits(1, effort=rng.uniform(20.0, 60.0)), np.array([[1.0]])
    q, v, box = np.array([rng.uniform(-2.0, 1.0)]), np.zeros(1), np.empty((2, 1))
    slowest = 0.3 * kept[4, 0]
    least = 0.0
    for _ in range(6000):
        compiled(acceleration_box)(q, v, B, kept, SETTINGS, box)
        alpha = min(box[1, 0], 30.0)
        least = min(least, alpha)
        v = v + 1e-3 * alpha
        q = q + 1e-3 * v
        assert q[0] < 3.0 + 1e-6
        assert v[0] <= 2.0 + 1e-9
    assert q[0] == pytest.approx(3.0, abs=1e-3)
    assert -least < 1.25 * slowest


def test_torques_bind_in_the_order_of_the_actuators() -> None:
    kept, order = limits(6), np.array([5, 3, 1, 0, 2, 4])
    kept[4] = np.arange(1.0, 7.0)
    u = 0.999 * kept[4][order]
    arguments = np.zeros(12), np.eye(6), np.zeros(6)
    assert not limits_bind(*arguments, u, order, kept, SETTINGS)
    for k in range(6):
        beyond = u.copy()
        beyond[k] *= -1.002
        assert limits_bind(*arguments, beyond, order, kept, SETTINGS)


def test_holding_back_gives_out_no_more_than_the_tank_has() -> None:
    rng = np.random.default_rng(6)
    M, tank, given, filled, withheld = spd(rng, 6), 0.2, 0.0, 0.0, 0
    for _ in range(2000):
        velocity, gained = 0.1 * rng.normal(size=6), 0.02
        slack = rng.normal(size=6) + velocity  # gives more than it takes
        held, tank = held_back(slack, velocity, M, gained, tank, 2.0, 1e-3)
        given += 1e-3 * (velocity @ M @ held)
        filled += 1e-3 * gained
        assert 0.0 <= tank <= 2.0
        assert given + tank <= 0.2 + filled + 1e-12
        if not np.array_equal(held, slack):
            withheld += 1
            assert velocity @ M @ held == pytest.approx(0.0, abs=1e-12)
            # Across the velocity nothing is withheld.
            np.testing.assert_allclose(np.cross(held[:3] - slack[:3], velocity[:3]), 0, atol=1e-12)
    assert 100 < withheld < 1900
