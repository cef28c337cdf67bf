"""Velocities, accelerations and wrenches of two hands and of what they hold."""

import numpy as np
import pytest
from hand_motions import (
    Rotating,
    angular_velocity,
    hands_about,
    mutual,
    random_quaternion,
    random_rotation,
    random_wave,
    rate,
    rotation_vector,
)
from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff

from geoimp_drake.laws.cooperation import (
    absolute_pose,
    absolute_velocity,
    moving_mutual_pose,
    mutual_pose,
    mutual_velocity,
    object_wrench,
    reference_pose,
    reference_velocity,
)
from geoimp_drake.laws.cooperation.half_rotation import half_rotation
from geoimp_drake.laws.cooperation.internal_wrench import internal_wrench
from geoimp_drake.laws.sensing.sensed_wrench import shifted_moment
from geoimp_drake.rotations import quaternion

SEEDS = pytest.mark.parametrize("seed", range(8))


def velocity(Q, p) -> np.ndarray:
    return np.concatenate((angular_velocity(Q), rate(p)))


def object_orientation(Q_W1, Q_W2, start):
    """Q_o of the hands' orientations, as a function of time."""

    def Q_WO(t: float) -> np.ndarray:
        Q_12 = mutual_pose.mutual_orientation(Q_W1(t), Q_W2(t), start)
        return absolute_pose.absolute_orientation(Q_W1(t), Q_12)

    return Q_WO


@SEEDS
def test_object_velocity_is_the_derivative_of_its_pose_if_the_mutual_axis_is_constant(seed) -> None:
    """The hands may turn about it against each other."""
    rng = np.random.default_rng(seed)
    Q_W1, axis = random_rotation(rng), rng.normal(size=3)
    wave, p_W1, p_W2 = (random_wave(rng) for _ in range(3))
    axis = axis / np.linalg.norm(axis)

    def Q_W2(t: float) -> np.ndarray:
        return quaternion.product(Q_W1(t), quaternion.exp((1.0 + 0.3 * wave(t)[0]) * axis))

    Q_WO = object_orientation(Q_W1, Q_W2, mutual(Q_W1(0.0), Q_W2(0.0)))
    V_WO = absolute_velocity.absolute_velocity(velocity(Q_W1, p_W1), velocity(Q_W2, p_W2))
    by_pose = velocity(Q_WO, lambda t: absolute_pose.absolute_position(p_W1(t), p_W2(t)))
    np.testing.assert_allclose(V_WO, by_pose, atol=1e-9)


@SEEDS
def test_otherwise_it_differs_by_the_stated_term(seed: int) -> None:
    rng = np.random.default_rng(seed)
    Q_W1, Q_W2 = random_rotation(rng), random_rotation(rng)
    start = mutual(Q_W1(0.0), Q_W2(0.0))
    Q_WO = object_orientation(Q_W1, Q_W2, start)

    def axis(t: float) -> np.ndarray:
        vector = rotation_vector(mutual_pose.mutual_orientation(Q_W1(t), Q_W2(t), start))
        return vector / np.linalg.norm(vector)

    mean = 0.5 * (angular_velocity(Q_W1) + angular_velocity(Q_W2))
    theta = np.linalg.norm(rotation_vector(start))
    term = (1.0 - np.cos(theta / 2)) * np.cross(axis(0.0), rate(axis))
    difference = mean - angular_velocity(Q_WO)
    assert np.linalg.norm(difference) > 1e-3
    R_WO = quaternion.to_rotation(Q_WO(0.0))
    np.testing.assert_allclose(R_WO.T @ difference, term, atol=1e-8)


@SEEDS
def test_mutual_velocity_is_the_derivative_of_the_mutual_pose(seed: int) -> None:
    rng = np.random.default_rng(seed)
    Q_W1, Q_W2, Q_WO = (random_rotation(rng) for _ in range(3))
    p_W1, p_W2 = random_wave(rng), random_wave(rng)
    V_21 = mutual_velocity.mutual_velocity(velocity(Q_W1, p_W1), velocity(Q_W2, p_W2))
    start = mutual(Q_W1(0.0), Q_W2(0.0))
    by_pose = angular_velocity(lambda t: mutual_pose.mutual_orientation(Q_W1(t), Q_W2(t), start))
    R_W1, R_WO = (quaternion.to_rotation(Q(0.0)) for Q in (Q_W1, Q_WO))
    w_12_1 = mutual_velocity.mutual_angular_velocity(R_W1, V_21[:3])
    np.testing.assert_allclose(w_12_1, by_pose, atol=1e-9)
    v_12_O = mutual_velocity.mutual_linear_velocity(
        R_WO, angular_velocity(Q_WO), p_W2(0.0) - p_W1(0.0), V_21[3:]
    )
    in_O = rate(lambda t: quaternion.to_rotation(Q_WO(t)).T @ (p_W2(t) - p_W1(t)))
    np.testing.assert_allclose(v_12_O, in_O, atol=1e-9)


@SEEDS
def test_printed_wrenches_and_velocities_are_dual(seed: int) -> None:
    h_1, h_2, V_W1, V_W2 = np.random.default_rng(seed).normal(size=(4, 6))
    power = object_wrench.printed_object_wrench(h_1, h_2) @ absolute_velocity.absolute_velocity(
        V_W1, V_W2
    ) + internal_wrench(h_1, h_2) @ mutual_velocity.mutual_velocity(V_W1, V_W2)
    np.testing.assert_allclose(power, h_1 @ V_W1 + h_2 @ V_W2, rtol=1e-12)


@SEEDS
def test_grasp_matrix_and_velocities_moved_to_the_object_are_dual(seed: int) -> None:
    rng = np.random.default_rng(seed)
    h_1, h_2, V_W1, V_W2 = rng.normal(size=(4, 6))
    p_O1 = rng.normal(size=3)
    p_O2 = -p_O1
    moved = [absolute_velocity.moved_velocity(V, -p) for V, p in ((V_W1, p_O1), (V_W2, p_O2))]
    about_O = [
        np.append(shifted_moment(h[:3], h[3:], -p), h[3:]) for h, p in ((h_1, p_O1), (h_2, p_O2))
    ]
    h_o = object_wrench.object_wrench(h_1, h_2, p_O1, p_O2)
    power = h_o @ absolute_velocity.absolute_velocity(*moved)
    power += internal_wrench(*about_O) @ mutual_velocity.mutual_velocity(*moved)
    np.testing.assert_allclose(power, h_1 @ V_W1 + h_2 @ V_W2, rtol=1e-12)
    # The two descriptions are not dual to each other.
    mismatched = h_o @ absolute_velocity.absolute_velocity(V_W1, V_W2)
    mismatched += internal_wrench(h_1, h_2) @ mutual_velocity.mutual_velocity(V_W1, V_W2)
    assert abs(mismatched - power) > 1e-3


@SEEDS
def test_grasp_matrix_is_that_of_the_object_wrench(seed: int) -> None:
    rng = np.random.default_rng(seed)
    h_1, h_2 = rng.normal(size=(2, 6))
    p_O1, p_O2 = rng.normal(size=(2, 3))
    h_o = object_wrench.object_wrench(h_1, h_2, p_O1, p_O2)
    W = object_wrench.grasp_matrix(p_O1, p_O2)
    np.testing.assert_allclose(W @ np.concatenate((h_1, h_2)), h_o, atol=1e-14)
    # A rigid body's hands move by Wᵀ.
    V_WO = rng.normal(size=6)
    hands = [absolute_velocity.moved_velocity(V_WO, p) for p in (p_O1, p_O2)]
    np.testing.assert_allclose(W.T @ V_WO, np.concatenate(hands), atol=1e-14)


def test_squeezing_is_an_internal_force_from_the_second_hand_to_the_first() -> None:
    push = np.array([0.0, 0.0, 0.0, 0.0, 30.0, 0.0])  # on the object; the second hand is at +y
    np.testing.assert_array_equal(internal_wrench(push, -push), -push)
    h_o = object_wrench.object_wrench(push, -push, np.array([0, -0.5, 0]), np.array([0, 0.5, 0]))
    np.testing.assert_array_equal(h_o, np.zeros(6))


class ObjectMotion:
    """C and a mutual pose, both functions of time; rigid if the mutual pose does not move."""

    def __init__(self, seed: int, rigid: bool):
        rng = np.random.default_rng(seed)
        size = 0.0 if rigid else 0.3
        self.Q_WC, self.p_WC = random_rotation(rng), random_wave(rng)
        self.Q_12 = Rotating(random_quaternion(rng), random_wave(rng, size))
        self.p_12_C = random_wave(rng, size)

    def hands(self, t: float) -> tuple[tuple, tuple]:
        return hands_about(self.Q_WC(t), self.p_WC(t), self.Q_12(t), self.p_12_C(t))

    def hand(self, k: int) -> tuple:
        """Orientation and position of a hand as functions of time."""
        return lambda t: self.hands(t)[k][0], lambda t: self.hands(t)[k][1]

    def velocity_of_C(self, t: float = 0.0) -> np.ndarray:
        return np.concatenate((angular_velocity(self.Q_WC, t), rate(self.p_WC, t)))

    def acceleration_of_C(self) -> np.ndarray:
        return rate(self.velocity_of_C)


def differences(motion: ObjectMotion) -> list[tuple[np.ndarray, np.ndarray]]:
    """Velocity and acceleration of both hands by finite differences of their poses."""
    found = []
    for k in range(2):
        Q, p = motion.hand(k)

        def V(t: float, Q=Q, p=p) -> np.ndarray:
            return np.concatenate((angular_velocity(Q, t), rate(p, t)))

        found.append((V(0.0), rate(V)))
    return found


@SEEDS
def test_rigid_references_move_as_their_poses_do(seed: int) -> None:
    motion = ObjectMotion(seed, rigid=True)
    V_WC, A_WC = motion.velocity_of_C(), motion.acceleration_of_C()
    p_12_W = quaternion.to_rotation(motion.Q_WC(0.0)) @ motion.p_12_C(0.0)
    V_21 = reference_velocity.rigid_mutual_velocity(V_WC[:3], p_12_W)
    A_21 = reference_velocity.rigid_mutual_acceleration(V_WC[:3], A_WC[:3], p_12_W)
    for law, (V, A) in zip(
        (reference_velocity.reference_velocity_1, reference_velocity.reference_velocity_2),
        differences(motion),
        strict=True,
    ):
        np.testing.assert_allclose(law(V_WC, V_21), V, atol=1e-8)
        np.testing.assert_allclose(law(A_WC, A_21), A, atol=1e-6)


@pytest.mark.parametrize("rigid", [True, False])
@SEEDS
def test_moving_references_move_as_their_poses_do(seed: int, rigid: bool) -> None:
    motion = ObjectMotion(seed, rigid)
    V_WC, A_WC = motion.velocity_of_C(), motion.acceleration_of_C()
    Q_WC, Q_12 = motion.Q_WC(0.0), motion.Q_12(0.0)
    rotations = moving_mutual_pose.reference_rotations(
        Q_WC,
        V_WC[:3],
        A_WC[:3],
        Q_12,
        angular_velocity(motion.Q_12),
        rate(lambda t: angular_velocity(motion.Q_12, t)),
    )
    p, v, a = moving_mutual_pose.mutual_position_motion(
        quaternion.to_rotation(Q_WC),
        V_WC[:3],
        A_WC[:3],
        motion.p_12_C(0.0),
        rate(motion.p_12_C),
        rate(lambda t: rate(motion.p_12_C, t)),
    )
    for k, (sign, (V, A)) in enumerate(zip((-0.5, 0.5), differences(motion), strict=True)):
        Q, w, dw = rotations[k]
        np.testing.assert_allclose(Q, motion.hands(0.0)[k][0], atol=1e-14)
        np.testing.assert_allclose(np.append(w, V_WC[3:] + sign * v), V, atol=1e-8)
        np.testing.assert_allclose(np.append(dw, A_WC[3:] + sign * a), A, atol=1e-6)
        np.testing.assert_allclose(motion.p_WC(0.0) + sign * p, motion.hands(0.0)[k][1], atol=1e-14)


def test_constant_mutual_position_in_W_would_open_the_grasp() -> None:
    """It is what is left without ω_c × Δp_r21."""
    motion = ObjectMotion(0, rigid=True)
    V_WC = motion.velocity_of_C()
    (V, _), _ = differences(motion)
    assert np.abs(reference_velocity.reference_velocity_1(V_WC, np.zeros(6)) - V).max() > 0.05


def test_laws_take_autodiff() -> None:
    rng = np.random.default_rng(1)
    x = rng.normal(size=38)
    for part in (slice(0, 4), slice(4, 8)):
        x[part] = quaternion.normalized(x[part])

    def laws(x: np.ndarray) -> np.ndarray:
        Q_1, Q_2 = x[:4], x[4:8]
        a, b, c, d, e, f = x[8:26].reshape(6, 3)
        V_1, V_2 = x[26:32], x[32:38]
        Q_12 = mutual_pose.mutual_orientation(Q_1, Q_2, np.array([1.0, 0.0, 0.0, 0.0]))
        Q_C = absolute_pose.absolute_orientation(Q_1, Q_12)
        R = quaternion.to_rotation(Q_C)
        V_21 = mutual_velocity.mutual_velocity(V_1, V_2)
        rotations = moving_mutual_pose.reference_rotations(Q_C, a, b, Q_12, c, d)
        return np.concatenate(
            [
                half_rotation(Q_12),
                mutual_velocity.mutual_angular_velocity(R, V_21[:3]),
                mutual_velocity.mutual_linear_velocity(R, a, b, V_21[3:]),
                object_wrench.object_wrench(V_1, V_2, a, b),
                internal_wrench(V_1, V_2),
                reference_pose.reference_orientation_1(Q_C, Q_12),
                reference_pose.reference_position_2(e, f),
                reference_velocity.rigid_mutual_acceleration(a, b, c),
                reference_velocity.rigid_mutual_velocity(a, b),
                absolute_velocity.moved_velocity(V_1, a),
                *moving_mutual_pose.mutual_position_motion(R, a, b, d, e, f),
                *rotations[0],
                *rotations[1],
            ]
        )

    by_autodiff = ExtractGradient(laws(InitializeAutoDiff(x).flatten()).reshape(-1, 1))
    steps = 1e-6 * np.eye(len(x))
    expected = np.stack([(laws(x + s) - laws(x - s)) / 2e-6 for s in steps], axis=-1)
    np.testing.assert_allclose(by_autodiff, expected, atol=1e-6)
