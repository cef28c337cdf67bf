"""Absolute and relative pose of two hands, their inverse, and hands that face each other."""

import numpy as np
import pytest
from hand_motions import hands_about, random_quaternion, rotation_vector, same_rotation

from geoimp_drake.errors import OutOfDomainError
from geoimp_drake.laws.cooperation import absolute_pose, mutual_pose, reference_pose
from geoimp_drake.laws.cooperation.half_rotation import check_half_defined, half_rotation
from geoimp_drake.rotations import quaternion

RNG = np.random.default_rng(3)


@pytest.mark.parametrize("seed", range(30))
def test_references_of_absolute_and_relative_pose_are_the_hands(seed: int) -> None:
    rng = np.random.default_rng(seed)
    p_W1, p_W2 = rng.normal(size=(2, 3))
    Q_W1, Q_W2 = random_quaternion(rng), random_quaternion(rng)
    Q_12 = mutual_pose.mutual_orientation_at_start(Q_W1, Q_W2)
    p_12 = mutual_pose.mutual_position(p_W1, p_W2)
    p_WO = absolute_pose.absolute_position(p_W1, p_W2)
    Q_WO = absolute_pose.absolute_orientation(Q_W1, Q_12)
    Q_r1 = reference_pose.reference_orientation_1(Q_WO, Q_12)
    np.testing.assert_allclose(reference_pose.reference_position_1(p_WO, p_12), p_W1, atol=1e-14)
    np.testing.assert_allclose(reference_pose.reference_position_2(p_WO, p_12), p_W2, atol=1e-14)
    assert same_rotation(Q_r1, Q_W1) < 1e-14
    assert same_rotation(reference_pose.reference_orientation_2(Q_r1, Q_12), Q_W2) < 1e-14


@pytest.mark.parametrize("seed", range(30))
def test_absolute_and_relative_pose_of_the_references_are_those_given(seed: int) -> None:
    """Also for ϑ_21 in (π, 2π), once the sign is known."""
    rng = np.random.default_rng(seed)
    Q_WC, Q_12, p_WC, p_12 = (
        random_quaternion(rng),
        random_quaternion(rng),
        *rng.normal(size=(2, 3)),
    )
    Q_r1 = reference_pose.reference_orientation_1(Q_WC, Q_12)
    Q_r2 = reference_pose.reference_orientation_2(Q_r1, Q_12)
    p_r1 = reference_pose.reference_position_1(p_WC, p_12)
    p_r2 = reference_pose.reference_position_2(p_WC, p_12)
    found = mutual_pose.mutual_orientation(Q_r1, -Q_r2, Q_12)
    np.testing.assert_allclose(found, Q_12, atol=1e-14)
    assert same_rotation(absolute_pose.absolute_orientation(Q_r1, found), Q_WC) < 1e-14
    np.testing.assert_allclose(absolute_pose.absolute_position(p_r1, p_r2), p_WC, atol=1e-14)
    np.testing.assert_allclose(mutual_pose.mutual_position(p_r1, p_r2), p_12, atol=1e-14)


@pytest.mark.parametrize("seed", range(10))
def test_object_turns_half_of_the_mutual_rotation_away_from_either_hand(seed: int) -> None:
    rng = np.random.default_rng(seed)
    Q_WO, Q_12 = random_quaternion(rng), random_quaternion(rng)
    (Q_W1, _), (Q_W2, _) = hands_about(Q_WO, np.zeros(3), Q_12, np.zeros(3))
    R_W1, R_W2 = quaternion.to_rotation(Q_W1), quaternion.to_rotation(Q_W2)
    R_WO = absolute_pose.absolute_rotation(R_W1, Q_12)
    np.testing.assert_allclose(R_WO, quaternion.to_rotation(Q_WO), atol=1e-14)
    np.testing.assert_allclose(R_W1.T @ R_WO, R_WO.T @ R_W2, atol=1e-14)
    by_matrix = mutual_pose.mutual_rotation(R_W1, R_W2)
    np.testing.assert_allclose(by_matrix, quaternion.to_rotation(Q_12), atol=1e-14)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 1.0, np.pi, 3.5, 6.0])
def test_half_rotation_has_half_the_angle_about_the_same_axis(angle: float) -> None:
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    Q = np.append(np.cos(angle / 2), np.sin(angle / 2) * axis)
    expected = np.append(np.cos(angle / 4), np.sin(angle / 4) * axis)
    np.testing.assert_allclose(half_rotation(Q), expected, atol=1e-15)


def test_a_whole_turn_between_the_hands_is_refused_with_the_angle() -> None:
    with pytest.raises(OutOfDomainError, match=r"ϑ_21 = 359\.4°"):
        check_half_defined(np.array([np.cos(np.deg2rad(179.7)), 0.01, 0.0, 0.0]))


@pytest.mark.parametrize("axis", [*np.eye(3), [0.6, -0.8, 0.0], [-0.5, 0.5, 0.7]])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_object_is_the_same_whatever_noise_does_to_hands_that_face_each_other(axis, sign) -> None:
    """At ϑ_21 = π: by the sign of η alone, O would be turned by 180° in every second sample."""
    rng = np.random.default_rng(5)
    r = sign * np.array(axis) / np.linalg.norm(axis)
    Q_W1 = random_quaternion(rng)
    Q_W2 = quaternion.product(Q_W1, np.append(0.0, r))
    start = mutual_pose.mutual_orientation_at_start(Q_W1, Q_W2)
    objects: list[np.ndarray] = []
    for _ in range(100):
        noisy = [
            quaternion.product(Q, quaternion.exp(1e-4 * rng.normal(size=3))) for Q in (Q_W1, Q_W2)
        ]
        samples = (
            mutual_pose.mutual_orientation(*noisy, start),
            mutual_pose.mutual_orientation_at_start(*noisy),
            mutual_pose.mutual_orientation(-noisy[0], noisy[1], start),
        )
        objects.extend(absolute_pose.absolute_orientation(noisy[0], Q_12) for Q_12 in samples)
    assert max(same_rotation(Q, objects[0]) for Q in objects) < 1e-3
    by_positive_eta = [
        absolute_pose.absolute_orientation(
            Q_W1, quaternion.relative(Q_W1, quaternion.product(Q_W2, quaternion.exp(e)))
        )
        for e in (1e-4 * r, -1e-4 * r)
    ]
    assert same_rotation(*by_positive_eta) > 0.5


def test_sign_follows_a_mutual_orientation_through_a_half_turn() -> None:
    Q_W1, axis = random_quaternion(RNG), np.array([0.0, 0.6, 0.8])
    angles = np.linspace(2.0, 4.5, 26)
    hands = [quaternion.product(Q_W1, quaternion.exp(angle * axis)) for angle in angles]
    start = mutual_pose.mutual_orientation_at_start(Q_W1, hands[0])
    for angle, Q_W2 in zip(angles, hands, strict=True):
        # As read from a rotation matrix, with η ≥ 0.
        read = quaternion.from_rotation(quaternion.to_rotation(Q_W2))
        Q_12 = mutual_pose.mutual_orientation(Q_W1, read, start)
        np.testing.assert_allclose(rotation_vector(Q_12), angle * axis, atol=1e-9)
