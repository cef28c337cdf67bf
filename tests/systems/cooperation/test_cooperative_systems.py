"""The object that two hands hold: its motion and wrench, and the hands' references, as systems."""

import numpy as np
import pytest
from hand_motions import hands_about, random_quaternion, same_rotation
from signal_sources import Rig

from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.laws.cooperation.hand_references import moving_references, rigid_references
from geoimp_drake.parts.grasp import MutualPose
from geoimp_drake.parts.object_load import ObjectLoad
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.cooperation.cooperative_kinematics import CooperativeKinematics
from geoimp_drake.systems.cooperation.cooperative_reference_generator import (
    CooperativeReferenceGenerator,
)
from geoimp_drake.systems.frame_motion import (
    ACCELERATION,
    ANGULAR_VELOCITY,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
    VELOCITY,
)

G = np.array([0.0, 0.0, -9.81])
LOAD = ObjectLoad(3.0, np.array([0.1, -0.2, 0.05]), np.diag([0.3, 0.2, 0.4]))
SEEDS = pytest.mark.parametrize("seed", range(5))


def motion_of(Q: np.ndarray, p: np.ndarray) -> np.ndarray:
    motion = np.zeros(19)
    motion[QUATERNION], motion[POSITION] = Q, p
    return motion


class Grasped:
    """A rigid object that moves anyhow, both hands on it, and the wrenches that carry it."""

    def __init__(self, seed: int, at_rest: bool = False):
        rng = np.random.default_rng(seed)
        self.O = motion_of(random_quaternion(rng), rng.normal(size=3))
        if not at_rest:
            self.O[7:] = rng.normal(size=12)
        pose = np.append(random_quaternion(rng), rng.normal(size=3))
        pose[0] = abs(pose[0]) + 0.2  # clear of ϑ_21 = π
        pose[:4] = quaternion.normalized(pose[:4])
        self.pose = pose
        self.hands = np.empty((2, 19))
        rigid_references(self.O, pose, self.hands)
        self.wrenches = self.carrying(rng)

    def carrying(self, rng) -> tuple[np.ndarray, np.ndarray]:
        """Wrenches of the hands: what the object needs by Newton and Euler, and any squeeze."""
        R = quaternion.to_rotation(self.O[QUATERNION])
        w, dw = self.O[ANGULAR_VELOCITY], self.O[ACCELERATION][:3]
        c, inertia = R @ LOAD.centre_of_mass, R @ LOAD.inertia @ R.T
        a = self.O[ACCELERATION][3:] + np.cross(dw, c) + np.cross(w, np.cross(w, c))
        force = LOAD.mass * (a - G)
        moment = np.cross(c, force) + inertia @ dw + np.cross(w, inertia @ w)
        first = rng.normal(size=6)
        p_1, p_2 = (hand[POSITION] - self.O[POSITION] for hand in self.hands)
        second_force = force - first[3:]
        second_moment = moment - first[:3] - np.cross(p_1, first[3:]) - np.cross(p_2, second_force)
        return first, np.append(second_moment, second_force)

    def signals(self, **changes) -> dict:
        return {
            "motion_1": self.hands[0],
            "motion_2": self.hands[1],
            "wrench_1": self.wrenches[0],
            "wrench_2": self.wrenches[1],
            "mutual_reference": motion_of(self.pose[:4], self.pose[4:]),
            **changes,
        }


@SEEDS
def test_object_motion_is_that_of_the_rigid_object(seed: int) -> None:
    grasped = Grasped(seed)
    rig = Rig(CooperativeKinematics(), grasped.signals())
    found = rig.read("object_motion")
    assert same_rotation(found[QUATERNION], grasped.O[QUATERNION]) < 1e-14
    np.testing.assert_allclose(found[4:], grasped.O[4:], atol=1e-13)
    mutual = rig.read("mutual_motion")
    np.testing.assert_allclose(mutual[:7], grasped.pose, atol=1e-13)
    np.testing.assert_allclose(mutual[7:], 0.0, atol=1e-13)


@SEEDS
def test_weight_and_inertial_load_are_removed_from_the_object_wrench(seed: int) -> None:
    grasped = Grasped(seed)
    contact = np.random.default_rng(seed).normal(size=6)
    h_2 = grasped.wrenches[1].copy()
    p_2 = grasped.hands[1][POSITION] - grasped.O[POSITION]
    h_2 += contact - np.append(np.cross(p_2, contact[3:]), np.zeros(3))
    signals = grasped.signals(wrench_2=h_2, reference_motion=grasped.O)
    rig = Rig(CooperativeKinematics(LOAD, G), signals)
    np.testing.assert_allclose(rig.read("object_wrench"), contact, atol=1e-12)


@SEEDS
def test_without_a_reference_motion_the_weight_alone_is_removed(seed: int) -> None:
    grasped = Grasped(seed, at_rest=True)
    rig = Rig(CooperativeKinematics(LOAD, G), grasped.signals())
    np.testing.assert_allclose(rig.read("object_wrench"), np.zeros(6), atol=1e-12)
    empty = Rig(CooperativeKinematics(), grasped.signals())
    np.testing.assert_allclose(empty.read("object_wrench")[3:], -LOAD.mass * G, atol=1e-12)


def test_printed_object_wrench_is_the_sum() -> None:
    grasped = Grasped(1)
    rig = Rig(CooperativeKinematics(wrench="printed"), grasped.signals())
    np.testing.assert_allclose(rig.read("object_wrench"), sum(grasped.wrenches), atol=1e-13)
    full = Rig(CooperativeKinematics(), grasped.signals()).read("object_wrench")
    assert np.abs(full - sum(grasped.wrenches)).max() > 0.1


@SEEDS
def test_internal_wrench_in_mutual_axes_has_the_same_power(seed: int) -> None:
    """On a mutual velocity beyond that of the object's rotation."""
    grasped = Grasped(seed, at_rest=True)
    rng = np.random.default_rng(seed)
    hands = [hand.copy() for hand in grasped.hands]
    rates = rng.normal(size=6)
    for hand, sign in zip(hands, (-1.0, 1.0), strict=True):
        hand[VELOCITY] = sign * rates  # the object rests in the middle
    rig = Rig(CooperativeKinematics(), grasped.signals(motion_1=hands[0], motion_2=hands[1]))
    mutual = rig.read("mutual_motion")
    in_mutual_axes = rig.read("mutual_wrench") @ mutual[VELOCITY]
    expected = rig.read("internal_wrench") @ (2.0 * rates)
    np.testing.assert_allclose(in_mutual_axes, expected, rtol=1e-12)
    np.testing.assert_allclose(
        rig.read("internal_wrench"), (grasped.wrenches[1] - grasped.wrenches[0]) / 2
    )


@pytest.mark.parametrize("port", ["motion_1", "motion_2", "wrench_1", "wrench_2"])
def test_nan_at_a_port_is_named(port: str) -> None:
    grasped = Grasped(0)
    signals = grasped.signals()
    signals[port] = np.full(len(signals[port]), np.nan)
    rig = Rig(CooperativeKinematics(), signals)
    with pytest.raises(SignalError, match=f"system:{port}"):
        rig.read("object_wrench")


def generator_signals(grasped: Grasped, C: np.ndarray | None = None) -> dict:
    return {
        "compliant_motion": grasped.O if C is None else C,
        "measured_motion_1": grasped.hands[0],
        "measured_motion_2": grasped.hands[1],
    }


@SEEDS
@pytest.mark.parametrize("started", [False, True])
def test_references_start_on_the_hands(seed: int, started: bool) -> None:
    grasped = Grasped(seed, at_rest=True)
    rig = Rig(CooperativeReferenceGenerator(), generator_signals(grasped))
    if started:
        rig.advance(0.01)
    for k, hand in enumerate(grasped.hands, 1):
        reference = rig.read(f"reference_motion_{k}")
        assert same_rotation(reference[QUATERNION], hand[QUATERNION]) < 1e-14
        np.testing.assert_allclose(reference[4:], hand[4:], atol=1e-13)


def test_mutual_pose_is_that_of_the_first_step_until_initialized_again() -> None:
    first, later = Grasped(0, at_rest=True), Grasped(1, at_rest=True)

    def switching(k: int):
        return lambda t: first.hands[k] if t < 0.0015 else later.hands[k]

    signals = {
        "compliant_motion": first.O,
        "measured_motion_1": switching(0),
        "measured_motion_2": switching(1),
    }
    rig = Rig(CooperativeReferenceGenerator(), signals).advance(0.01)
    np.testing.assert_allclose(rig.read("mutual_reference")[:7], first.pose, atol=1e-13)
    clone = rig.simulator.get_context().Clone()
    rig.simulator.Initialize()
    np.testing.assert_allclose(rig.read("mutual_reference")[:7], later.pose, atol=1e-13)
    rig.advance(0.02)
    np.testing.assert_allclose(rig.read("mutual_reference")[:7], later.pose, atol=1e-13)
    held = rig.read("mutual_reference", clone)
    np.testing.assert_allclose(held[:7], first.pose, atol=1e-13)


def test_prescribed_mutual_pose_takes_the_place_of_the_measured_one() -> None:
    grasped = Grasped(2)
    pose = MutualPose(np.array([0.6, 0.0, 0.8, 0.0]), np.array([0.1, 1.0, -0.3]))
    rig = Rig(CooperativeReferenceGenerator(pose), generator_signals(grasped)).advance(0.005)
    first, second = rig.read("reference_motion_1"), rig.read("reference_motion_2")
    Q_12 = quaternion.relative(first[QUATERNION], second[QUATERNION])
    np.testing.assert_allclose(Q_12, pose.quaternion, atol=1e-14)
    R_WC = quaternion.to_rotation(grasped.O[QUATERNION])
    np.testing.assert_allclose(
        R_WC.T @ (second[POSITION] - first[POSITION]), pose.position, atol=1e-13
    )


@pytest.mark.parametrize(
    ("pose", "text"),
    [
        (MutualPose(np.array([1.0, 0.1, 0.0, 0.0])), "mutual_pose.quaternion is not a unit"),
        (MutualPose(position=np.array([0.0, np.nan, 0.0])), "mutual_pose.position"),
    ],
)
def test_bad_prescribed_pose_is_named(pose: MutualPose, text: str) -> None:
    with pytest.raises((ConfigurationError, SignalError), match=text):
        CooperativeReferenceGenerator(pose)


@SEEDS
def test_references_with_a_mutual_motion_at_rest_are_those_without_it(seed: int) -> None:
    grasped = Grasped(seed)
    resting = np.empty((2, 19))
    moving_references(grasped.O, motion_of(grasped.pose[:4], grasped.pose[4:]), resting)
    for moving, rigid in zip(resting, grasped.hands, strict=True):
        np.testing.assert_allclose(moving, rigid, atol=1e-13)


@SEEDS
def test_mutual_motion_of_moving_references_is_the_one_given(seed: int) -> None:
    """So the references carry what the internal impedance asks for, and C lies in the middle."""
    rng = np.random.default_rng(seed)
    grasped = Grasped(seed)
    mutual = motion_of(grasped.pose[:4], grasped.pose[4:])
    mutual[VELOCITY] = 0.3 * rng.normal(size=6)
    hands = np.empty((2, 19))
    moving_references(grasped.O, mutual, hands)
    rig = Rig(CooperativeKinematics(), grasped.signals(motion_1=hands[0], motion_2=hands[1]))
    middle, found = rig.read("object_motion"), rig.read("mutual_motion")
    assert same_rotation(middle[QUATERNION], grasped.O[QUATERNION]) < 1e-14
    np.testing.assert_allclose(middle[LINEAR_VELOCITY], grasped.O[LINEAR_VELOCITY], atol=1e-13)
    np.testing.assert_allclose(found[:10], mutual[:10], atol=1e-13)


def test_hands_of_the_references_hold_the_object_as_hands_do() -> None:
    grasped = Grasped(3)
    by_hand = hands_about(
        grasped.O[QUATERNION], grasped.O[POSITION], grasped.pose[:4], grasped.pose[4:]
    )
    for (Q, p), hand in zip(by_hand, grasped.hands, strict=True):
        assert same_rotation(Q, hand[QUATERNION]) < 1e-14
        np.testing.assert_allclose(p, hand[POSITION], atol=1e-13)


def test_bad_load_is_named() -> None:
    for load, text in (
        (ObjectLoad(mass=-1.0), "load.mass"),
        (ObjectLoad(inertia=-np.eye(3)), "load.inertia"),
        (ObjectLoad(inertial_load="plant"), "inertial_load"),
    ):
        with pytest.raises(ConfigurationError, match=text):
            CooperativeKinematics(load)
    with pytest.raises(ConfigurationError, match="Valid: grasp-matrix, printed"):
        CooperativeKinematics(wrench="sum")
