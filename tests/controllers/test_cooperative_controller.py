"""The controller of two arms as a user sees it: our arms facing each other, with empty hands."""

import numpy as np
import pytest
from hand_motions import same_rotation
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable, SpatialInertia
from pydrake.systems.analysis import Simulator
from two_arms import ArmPair, add_arms, make_controlled_pair

from geoimp_drake.controllers.cooperative_config import CooperativeControllerConfig
from geoimp_drake.controllers.cooperative_controller import make_cooperative_controller
from geoimp_drake.controllers.impedance_config import RotationGains, TranslationGains
from geoimp_drake.errors import ConfigurationError, ModelError
from geoimp_drake.parts.grasp import MutualPose
from geoimp_drake.parts.object_load import ObjectLoad
from geoimp_drake.systems.arm.redundancy_resolver import RedundancyResolver
from geoimp_drake.systems.frame_motion import (
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
    frame_motion_at_rest,
    pose_of,
)
from geoimp_drake.systems.sources.desired_motion import DesiredMotion, MotionSegment


class Ports:
    """A controller alone, its inputs given by hand."""

    def __init__(self, pair: ArmPair, config: CooperativeControllerConfig | None = None, **options):
        self.pair = pair
        self.controller = pair.controller(config, **options)
        self.simulator = Simulator(self.controller)
        self.give("desired_motion", frame_motion_at_rest(RigidTransform()))
        for k, q in enumerate(pair.postures, 1):
            self.give(f"estimated_state_{k}", np.concatenate((q, np.zeros_like(q))))
            self.give(f"wrench_{k}", np.zeros(6))

    def give(self, port: str, value: np.ndarray) -> None:
        self.controller.GetInputPort(port).FixValue(self.simulator.get_mutable_context(), value)

    def desire_what_is(self) -> "Ports":
        self.give("desired_motion", self.read("object_motion"))
        return self

    def read(self, port: str) -> np.ndarray:
        return self.controller.GetOutputPort(port).Eval(self.simulator.get_context()).copy()


def quiet_config(**fields) -> CooperativeControllerConfig:
    """Nothing answers to a wrench but the arms' own dynamics."""
    config = CooperativeControllerConfig(**fields)
    config.impedance.axes = "none"
    config.internal.enabled = False
    return config


@pytest.fixture(scope="module")
def parallel() -> ArmPair:
    return add_arms(MultibodyPlant(1e-3))


@pytest.fixture(scope="module")
def facing() -> ArmPair:
    return add_arms(MultibodyPlant(1e-3), parallel=False)


@pytest.mark.parametrize("is_parallel", [True, False])
def test_both_hands_follow_the_motion_of_their_object(is_parallel: bool) -> None:
    frames = add_arms(MultibodyPlant(1e-3), parallel=is_parallel)
    X_WO = pose_of_object(frames)
    move = MotionSegment(0.4, np.array([0.003, -0.002, -0.004]), np.array([0.006, -0.004, 0.007]))
    desired = DesiredMotion(X_WO, [move])
    pair = make_controlled_pair(desired.evaluate, parallel=is_parallel)
    start = [pair.true_pose(k) for k in range(2)]
    errors = []
    for time in np.arange(0.02, 0.44, 0.02):
        pair.simulator.AdvanceTo(time)
        errors.append(pair.tracking_error())
    distance, angle = np.max(errors, axis=0)
    print(f"\ngreatest tracking error {distance * 1e3:.3f} mm, {angle:.1e} rad")
    assert distance < 1e-4
    assert angle < 2e-4
    # Each hand has moved as a point of a rigid object.
    for k in range(2):
        expected = pose_of(desired.evaluate(1.0)) @ X_WO.inverse() @ start[k].translation()
        np.testing.assert_allclose(pair.true_pose(k).translation(), expected, atol=1e-4)
        assert np.linalg.norm(expected - start[k].translation()) > 2e-3


def pose_of_object(pair: ArmPair) -> RigidTransform:
    return pose_of(Ports(pair).read("object_motion"))


def test_at_the_start_the_references_are_the_hands_and_C_is_the_object(parallel: ArmPair) -> None:
    ports = Ports(parallel).desire_what_is()
    for initialized in (False, True):
        if initialized:
            ports.simulator.AdvanceTo(0.002)
        np.testing.assert_allclose(
            ports.read("compliant_motion"), ports.read("object_motion"), atol=1e-12
        )
        for k in (1, 2):
            reference = ports.read(f"reference_motion_{k}")
            np.testing.assert_allclose(reference, ports.read(f"measured_motion_{k}"), atol=1e-12)


def test_parallel_frames_give_an_object_parallel_to_the_world(parallel: ArmPair) -> None:
    motion = Ports(parallel).read("object_motion")
    assert same_rotation(motion[QUATERNION], np.array([1.0, 0.0, 0.0, 0.0])) < 1e-6


def test_object_of_hands_that_face_each_other_moves_continuously(facing: ArmPair) -> None:
    """ϑ_21 is π; the joints' noise takes it to either side."""
    rng = np.random.default_rng(0)
    ports = Ports(facing)
    motions, signs = [], []
    for step in range(1, 61):
        for k, q in enumerate(facing.postures, 1):
            noisy = q + 1e-4 * rng.normal(size=len(q))
            ports.give(f"estimated_state_{k}", np.append(noisy, np.zeros_like(q)))
        ports.simulator.AdvanceTo(step * 1e-3)
        motions.append(ports.read("object_motion"))
        signs.append(ports.read("mutual_motion")[0] > 0)
    assert 10 < np.sum(signs) < 50  # of η
    for motion in motions:
        assert same_rotation(motion[QUATERNION], motions[0][QUATERNION]) < 1e-3
        np.testing.assert_allclose(motion[POSITION], motions[0][POSITION], atol=1e-3)
    # And from one start to another.
    for _ in range(10):
        ports.give("estimated_state_1", np.append(facing.postures[0], np.zeros(7)))
        q = facing.postures[1] + 1e-4 * rng.normal(size=6)
        ports.give("estimated_state_2", np.append(q, np.zeros(6)))
        ports.simulator.Initialize()
        again = ports.read("object_motion")
        assert same_rotation(again[QUATERNION], motions[0][QUATERNION]) < 1e-3


def test_each_arm_compensates_its_own_wrench(parallel: ArmPair) -> None:
    ports = Ports(parallel, quiet_config()).desire_what_is()
    before = [ports.read(f"actuation_{k}") for k in (1, 2)]
    h = np.array([1.0, -2.0, 0.5, 10.0, -20.0, 15.0])
    ports.give("wrench_2", h)
    np.testing.assert_allclose(ports.read("actuation_1"), before[0], atol=1e-9)
    plant, (_, arm), (_, E) = parallel.plant, parallel.arms, parallel.frames
    context = plant.CreateDefaultContext()
    J = plant.CalcJacobianSpatialVelocity(
        context, JacobianWrtVariable.kV, E, np.zeros(3), plant.world_frame(), plant.world_frame()
    )
    own = J[:, plant.GetVelocitiesFromArray(arm, np.arange(13)).astype(int)]
    np.testing.assert_allclose(ports.read("actuation_2") - before[1], own.T @ h, atol=1e-8)


def test_weight_of_the_object_moves_nothing_but_is_carried(parallel: ArmPair) -> None:
    """It is removed from the impedance's wrench, and stays in (2.3)."""
    config = CooperativeControllerConfig(load=ObjectLoad(mass=6.0))
    ports = Ports(parallel, config).desire_what_is()
    empty = ports.read("actuation_1")
    share = np.array([0.0, 0.0, 0.0, 0.0, 0.0, -3.0 * 9.81])
    for k in (1, 2):
        # The hands push the object up, that is against gravity.
        ports.give(f"wrench_{k}", -share)
    np.testing.assert_allclose(ports.read("object_wrench"), np.zeros(6), atol=1e-9)
    acceleration = ports.read("compliant_motion")[LINEAR_ACCELERATION]
    np.testing.assert_allclose(acceleration, np.zeros(3), atol=1e-9)
    assert np.abs(ports.read("actuation_1") - empty).max() > 10.0
    ignorant = Ports(parallel).desire_what_is()
    for k in (1, 2):
        ignorant.give(f"wrench_{k}", -share)
    assert np.abs(ignorant.read("compliant_motion")[LINEAR_ACCELERATION]).max() > 1.0


def test_load_welded_to_a_hand_is_left_out_of_its_model() -> None:
    def holding_torque(mass: float, named: bool) -> np.ndarray:
        plant = MultibodyPlant(1e-3)
        bar = plant.AddModelInstance("bar")
        body = plant.AddRigidBody("bar", bar, SpatialInertia.SolidBoxWithMass(mass, 0.1, 0.1, 0.1))
        pair = add_arms(plant, (6, 6), carried=body)
        ports = Ports(pair, quiet_config(), loads=(bar,) if named else ())
        return ports.desire_what_is().read("actuation_1")

    np.testing.assert_allclose(holding_torque(5.0, True), holding_torque(1.0, True), atol=1e-6)
    assert np.abs(holding_torque(5.0, False) - holding_torque(1.0, False)).max() > 10.0


def test_prescribed_mutual_pose_is_approached_from_the_measured_one(parallel: ArmPair) -> None:
    """With the internal impedance without a step; with it switched off at once."""
    measured = Ports(parallel).read("mutual_reference")
    pose = MutualPose(measured[QUATERNION], measured[POSITION] + [0.0, 0.002, 0.0])
    for enabled, away in ((True, 0.0), (False, 0.001)):
        config = CooperativeControllerConfig(mutual_pose=pose)
        config.internal.enabled = enabled
        ports = Ports(parallel, config).desire_what_is()
        reference, hand = ports.read("reference_motion_2"), ports.read("measured_motion_2")
        np.testing.assert_allclose((reference - hand)[POSITION], [0.0, away, 0.0], atol=1e-9)


def test_opened_grasp_brings_both_hands_to_rest(caplog) -> None:
    pair = add_arms(MultibodyPlant(1e-3))
    X_WO = pose_of_object(pair)
    desired = DesiredMotion(X_WO, [MotionSegment(0.5, np.array([0.0, 0.0, -0.05]))])
    # Small: nothing pushes back, so the wrench that (2.3) compensates moves the hands away.
    held = np.array([0.0, 0.0, 0.0, 0.0, 1.2, 1.4])

    def opening(t: float) -> np.ndarray:
        return held * (t < 0.15)

    config = CooperativeControllerConfig()
    config.impedance.translation = TranslationGains(*map(np.array, (30.0, 555.0, 1300.0)))
    config.monitor.force_threshold = 0.4
    config.impedance.rotation = RotationGains(*map(np.array, (10.0, 35.0, 20.0)))
    controlled = make_controlled_pair(desired.evaluate, config, wrenches=(lambda t: held, opening))
    controlled.simulator.AdvanceTo(0.15)
    moving = controlled.read("measured_motion_1")
    assert np.linalg.norm(moving[LINEAR_VELOCITY]) > 0.05
    controlled.simulator.AdvanceTo(0.171)
    opened = controlled.read("opened")
    np.testing.assert_array_equal(opened[:2], [0.0, 1.0])
    assert opened[2] < 0.17
    assert "second hand has opened" in caplog.text
    controlled.simulator.AdvanceTo(0.22)
    for k in (1, 2):
        assert np.linalg.norm(controlled.read(f"reference_motion_{k}")[LINEAR_VELOCITY]) < 0.02
        assert np.linalg.norm(controlled.read(f"measured_motion_{k}")[LINEAR_VELOCITY]) < 0.05


def test_parts_that_are_switched_off_are_not_there(parallel: ArmPair) -> None:
    config = CooperativeControllerConfig()
    config.monitor.enabled = config.internal.enabled = False
    controller = parallel.controller(config)
    assert not controller.HasOutputPort("opened")
    assert not controller.HasSubsystemNamed("internal_impedance")
    config.monitor.enabled = config.internal.enabled = True
    controller = parallel.controller(config)
    assert controller.HasOutputPort("opened")
    assert controller.HasSubsystemNamed("internal_impedance")


def test_spare_joint_comes_to_rest_by_default(parallel: ArmPair) -> None:
    config = CooperativeControllerConfig()
    controller = parallel.controller(config)  # which must live as long as its systems are asked for
    arm = controller.GetSubsystemByName("arm_1")
    assert isinstance(arm.GetSubsystemByName("redundancy"), RedundancyResolver)
    assert config.redundancy_1.k_beta == 0.0
    config.redundancy_1.K_n = np.eye(6)
    with pytest.raises(ConfigurationError, match="redundancy"):
        parallel.controller(config)


def test_wrong_arms_are_named(parallel: ArmPair) -> None:
    plant, arms, frames = parallel.plant, parallel.arms, parallel.frames
    with pytest.raises(ModelError, match="1 model instances"):
        make_cooperative_controller(plant, arms[:1], frames)
    with pytest.raises(ModelError, match="give two"):
        make_cooperative_controller(plant, (arms[0], arms[0]), frames)
    with pytest.raises(ModelError, match="joints that do not belong"):
        make_cooperative_controller(plant, arms, frames[::-1])
    with pytest.raises(ConfigurationError, match="3 task functions"):
        make_cooperative_controller(plant, arms, frames, task_functions=(None,) * 3)
