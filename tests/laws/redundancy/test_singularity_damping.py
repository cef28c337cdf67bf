"""Near singularities the pseudo-inverse stays bounded; away from them damping does nothing."""

import numpy as np
import pytest
from redundant_arms import Resolver, arm_at, generated_arm, random_states, track_arm

from geoimp_drake.laws.redundancy.damped_pseudo_inverse import (
    SingularityDamping,
    damped_pseudo_inverse,
    singular_value_or_bound,
    smallest_singular_value,
)
from geoimp_drake.laws.redundancy.pseudo_inverse import (
    null_space_projector,
    weighted_pseudo_inverse,
)

TRACK = track_arm()
DAMPING = SingularityDamping(0.05, 0.03)


def singular_direction(model) -> tuple[np.ndarray, np.ndarray]:
    """Returns a posture of the track arm whose Jacobian is singular, and a direction out of it."""
    # Wrist stretched: the axes of forearm and tool are parallel; waist and track are lined up.
    q = np.array([0.0, 0.0, -0.4, 1.3, 0.0, 0.0, 0.0])
    return q, np.array([0.0, 0.3, 0.1, -0.2, 0.2, 1.0, 0.0])


def near_singular(distance: float) -> np.ndarray:
    q, direction = singular_direction(TRACK)
    return arm_at(TRACK, np.concatenate((q + distance * direction, np.zeros(7)))).Jv_V_WE


def damped(J: np.ndarray, W_inverse: np.ndarray, damping=DAMPING):
    return damped_pseudo_inverse(J, W_inverse, smallest_singular_value(J), damping)


def test_scenario_is_a_singularity() -> None:
    assert smallest_singular_value(near_singular(0.0)) < 1e-12
    assert smallest_singular_value(near_singular(0.5)) > 0.05


def test_bound_of_the_singular_value_is_near_it_and_below() -> None:
    for state in random_states(TRACK, 20):
        J = arm_at(TRACK, state).Jv_V_WE
        sigma, bound = smallest_singular_value(J), singular_value_or_bound(J, 0.0)
        assert sigma / np.sqrt(6.0) <= bound <= sigma
        assert singular_value_or_bound(J, bound) == bound
        assert singular_value_or_bound(J, np.nextafter(bound, 1.0)) == sigma


@pytest.mark.parametrize("distance", [0.0, 1e-9, 1e-4])
def test_near_a_singularity_the_singular_value_itself_is_taken(distance: float) -> None:
    J = near_singular(distance)
    assert singular_value_or_bound(J, 0.01) == smallest_singular_value(J)
    lost = J.copy()
    lost[2] = 0.0
    assert singular_value_or_bound(lost, 0.01) == pytest.approx(0.0, abs=1e-12)


def test_reported_singular_value_is_that_of_the_jacobian() -> None:
    resolver = Resolver.of(TRACK)
    for state in random_states(TRACK, 5):
        resolver.at(state, np.zeros(6))
        expected = np.linalg.svd(arm_at(TRACK, state).Jv_V_WE, compute_uv=False)[-1]
        assert resolver.read("smallest_singular_value")[0] == pytest.approx(expected, rel=1e-12)


def test_above_the_threshold_damping_changes_no_bit() -> None:
    for state in random_states(TRACK, 20):
        arm = arm_at(TRACK, state)
        assert smallest_singular_value(arm.Jv_V_WE) > DAMPING.threshold
        W_inverse = np.linalg.inv(arm.B)
        plain = weighted_pseudo_inverse(arm.Jv_V_WE, W_inverse)
        J_pinv, N = damped(arm.Jv_V_WE, W_inverse)
        np.testing.assert_array_equal(J_pinv, plain)
        np.testing.assert_array_equal(N, null_space_projector(arm.Jv_V_WE, plain))


def test_joint_acceleration_above_the_threshold_is_the_undamped_one_to_the_bit() -> None:
    a = np.arange(1.0, 7.0)
    for state in random_states(TRACK, 10):
        off, on = (
            Resolver.of(TRACK, damping=SingularityDamping(threshold, 0.5)).at(state, a)
            for threshold in (0.0, 0.05)
        )
        np.testing.assert_array_equal(on, off)


@pytest.mark.parametrize("model", [TRACK, generated_arm(8)], ids=["track", "eight"])
def test_every_singular_value_is_inverted_as_said(model) -> None:
    # With W = I the singular values of J† are the damped inverses of those of J.
    damping = SingularityDamping(1.0, 0.4)
    for state in random_states(model, 5):
        J = arm_at(model, state).Jv_V_WE
        s = np.linalg.svd(J, compute_uv=False)
        assert s[-1] < 1.0
        weak = 0.4**2 * np.maximum(0.0, 1.0 - s**2)
        expected = np.sort(s / (s**2 + weak))
        J_pinv, _ = damped(J, np.eye(model.num_joints), damping)
        ours = np.sort(np.linalg.svd(J_pinv, compute_uv=False))
        np.testing.assert_allclose(ours, expected, rtol=1e-10)


def test_pseudo_inverse_does_not_explode_at_the_singularity() -> None:
    q, _ = singular_direction(TRACK)
    W_inverse = np.linalg.inv(arm_at(TRACK, np.concatenate((q, np.zeros(7)))).B)
    # cond(W)^½ bounds what the weight can add to 1/(2λ₀) and 1/σ₀.
    bound = np.sqrt(np.linalg.cond(W_inverse)) / min(2 * DAMPING.factor, DAMPING.threshold)
    largest = []
    for distance in (0.3, 1e-1, 1e-2, 1e-4, 1e-8, 0.0):
        J = near_singular(distance)
        J_pinv, N = damped(J, W_inverse)
        largest.append(np.linalg.norm(J_pinv, 2))
        assert np.isfinite(J_pinv).all()
        np.testing.assert_allclose(J @ N, 0.0, atol=1e-10)
        np.testing.assert_allclose(N @ N, N, atol=1e-10)
    print(f"largest ‖J†‖ {max(largest):.1f}, bound {bound:.1f}")
    assert max(largest) < bound
    undamped, _ = damped(near_singular(1e-8), W_inverse, SingularityDamping(0.0))
    assert np.linalg.norm(undamped, 2) > 1e5


def test_damping_sets_in_continuously() -> None:
    J = near_singular(0.5)
    sigma = smallest_singular_value(J)
    W_inverse = np.linalg.inv(np.diag(np.arange(1.0, 8.0)))
    above, N_above = damped(J, W_inverse, SingularityDamping(sigma * (1 - 1e-9), 0.1))
    below, N_below = damped(J, W_inverse, SingularityDamping(sigma * (1 + 1e-9), 0.1))
    np.testing.assert_allclose(below, above, rtol=0, atol=1e-6 * np.abs(above).max())
    np.testing.assert_allclose(N_below, N_above, rtol=0, atol=1e-12)


def test_joint_acceleration_is_bounded_through_the_singularity() -> None:
    q, direction = singular_direction(TRACK)
    a = np.full(6, 1.0)
    resolver = Resolver.of(TRACK, damping=DAMPING)
    sizes = [
        np.linalg.norm(resolver.at(np.concatenate((q + s * direction, 0.1 * direction)), a))
        for s in np.linspace(-0.3, 0.3, 61)
    ]
    undamped = Resolver.of(TRACK, damping=SingularityDamping(0.0))
    exploding = undamped.at(np.concatenate((q + 1e-6 * direction, 0.1 * direction)), a)
    print(f"largest |α| {max(sizes):.0f}, undamped {np.linalg.norm(exploding):.1e}")
    assert max(sizes) < 500.0
    assert np.linalg.norm(exploding) > 1e4
