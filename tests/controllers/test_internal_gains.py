"""Two arms from one file hold a bar rigidly: the internal impedance that follows from the arms."""

import logging
from dataclasses import dataclass

import numpy as np
import pytest
from internal_gains import bar_internal
from published_arms import write_dual_urdf
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput
from signal_sources import Rig, fixed_step
from two_arms import add_arms

from geoimp_drake import (
    DesiredMotion,
    WristSensorConfig,
    connect_wrist_sensors,
    find_start_posture,
    load_robot,
    make_cooperative_controller,
    wrist_sensor_at,
)
from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.cooperative_config import (
    CooperativeControllerConfig,
    InternalGains,
    MutualPose,
    ObjectLoad,
)
from geoimp_drake.controllers.internal_gains import (
    fill_open_gains,
    hands_against_each_other,
    make_internal,
)
from geoimp_drake.controllers.wrist_sensor import tool_load_beyond
from geoimp_drake.errors import SignalError
from geoimp_drake.parts.internal_impedance import InternalImpedanceConfig, is_open
from geoimp_drake.systems.cooperation.internal_impedance import InternalImpedance

HANDS, CENTRE, MASS = (-0.2, 0.2), np.array([0.55, 0.0, 0.75]), 1.0
ERROR = 2e-3  # by which the controller takes the bar for longer than it is [m]


@dataclass
class HeldBar:
    plant: MultibodyPlant
    builder: DiagramBuilder
    arms: list
    hands: list
    joints: list
    bar: object
    inertia: SpatialInertia


def held_bar(file) -> HeldBar:
    """Returns the two arms with a bar along y, welded to the right hand and held by the left."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    robots = load_robot(file, plant, end_effectors=["right_tool0", "left_tool0"])
    arms, hands = zip(*((r.model_instance, r.end_effector_frame) for r in robots), strict=True)
    bar = plant.AddModelInstance("bar")
    inertia = SpatialInertia.SolidCylinderWithMass(MASS, 0.02, 0.4, [0.0, 1.0, 0.0])
    body = plant.AddRigidBody("bar", bar, inertia)
    plant.WeldFrames(hands[0], body.body_frame(), RigidTransform([0.0, -HANDS[0], 0.0]))
    X_OE = RigidTransform([0.0, HANDS[1], 0.0])
    plant.AddWeldConstraint(hands[1].body(), hands[1].GetFixedPoseInBodyFrame(), body, X_OE)
    plant.Finalize()
    for arm, hand, y in zip(arms, hands, HANDS, strict=True):
        model = ControlModel.of_arm(plant, arm, hand, without=[bar])
        X_WE = RigidTransform(CENTRE + np.array([0.0, y, 0.0]))
        plant.SetDefaultPositions(arm, find_start_posture(model, X_WE))
    joints = [robot.sensor_joint for robot in robots]
    return HeldBar(plant, builder, list(arms), list(hands), joints, bar, inertia)


def squeeze(held: HeldBar, internal: InternalImpedanceConfig, time: float) -> np.ndarray:
    """Returns the force along the bar over time [N]."""
    plant, builder = held.plant, held.builder
    config = CooperativeControllerConfig(form="compiled", internal=internal)
    config.mutual_pose = MutualPose(position=np.array([0.0, 0.4 + ERROR, 0.0]))
    moments = held.inertia.CalcRotationalInertia().CopyToFullMatrix3()
    config.load = ObjectLoad(mass=MASS, inertia=moments)
    reads = WristSensorConfig(inertial_load="plant")
    sensors = [
        wrist_sensor_at(plant, joint, hand, reads, tool_load_beyond(plant, joint, [held.bar]))
        for joint, hand in zip(held.joints, held.hands, strict=True)
    ]
    controller = builder.AddSystem(
        make_cooperative_controller(
            plant, held.arms, held.hands, config, loads=[held.bar], sensors=sensors
        )
    )
    connect_wrist_sensors(builder, plant, controller)
    desired = builder.AddSystem(DesiredMotion(RigidTransform(CENTRE), []))
    builder.Connect(desired.get_output_port(), controller.GetInputPort("desired_motion"))
    for k, arm in enumerate(held.arms, 1):
        state = plant.get_state_output_port(arm)
        builder.Connect(state, controller.GetInputPort(f"estimated_state_{k}"))
        torque = plant.get_actuation_input_port(arm)
        builder.Connect(controller.GetOutputPort(f"actuation_{k}"), torque)
    log = LogVectorOutput(controller.GetOutputPort("internal_wrench"), builder, 1e-3)
    simulator = fixed_step(builder.Build())
    simulator.AdvanceTo(time)
    return log.FindLog(simulator.get_context()).data()[4]


def warnings(caplog) -> list[str]:
    return [r.getMessage() for r in caplog.records if "stiff grasp" in r.getMessage()]


@pytest.fixture
def held(tmp_path) -> HeldBar:
    return held_bar(write_dual_urdf(tmp_path))


def test_by_default_a_rigid_grasp_is_held_and_the_stiffness_times_the_error_is_left(
    held, caplog
) -> None:
    force = squeeze(held, InternalImpedanceConfig(), 1.0)
    print(f"\nlargest {np.abs(force).max():.2f} N, at last {force[-1]:.3f} N")
    np.testing.assert_allclose(force[-200:], 2000.0 * ERROR, rtol=0.02)
    assert np.abs(force).max() < 3.0 * 2000.0 * ERROR
    assert not warnings(caplog)


def test_gains_that_throw_a_rigid_grasp_about_are_named_before_they_do(held, caplog) -> None:
    light = InternalGains(np.array(0.5), np.array(60.0), np.array(2000.0))
    with caplog.at_level(logging.WARNING, logger="drake"):
        try:
            force = squeeze(held, bar_internal(translation=light), 0.2)
        except SignalError:
            force = np.array([np.inf])
    assert np.abs(force).max() > 100.0
    (said,) = warnings(caplog)
    assert "0.5 kg" in said
    assert "at steps of 0.001 s" in said


def models_of(joints=(6, 6)) -> list[ControlModel]:
    pair = add_arms(MultibodyPlant(1e-3), joints)
    return [
        ControlModel.of_arm(pair.plant, arm, E)
        for arm, E in zip(pair.arms, pair.frames, strict=True)
    ]


def test_only_open_gains_follow_from_the_arms() -> None:
    config = CooperativeControllerConfig()
    inertia = hands_against_each_other(models_of())
    given = InternalImpedanceConfig(translation=InternalGains(mass=np.array(30.0)))
    filled = fill_open_gains(given, inertia, config.motion, 1e-3)
    assert filled.translation.mass == 30.0
    assert filled.translation.stiffness == 2000.0
    assert not is_open(filled.rotation.mass)
    assert fill_open_gains(filled, 10.0 * inertia, config.motion, 1e-3) == filled
    tenfold = fill_open_gains(given, 10.0 * inertia, config.motion, 1e-3)
    np.testing.assert_allclose(tenfold.rotation.mass, 10.0 * filled.rotation.mass, rtol=1e-2)


def test_arms_that_are_stretched_by_default_are_weighed_in_another_posture() -> None:
    models = models_of()
    bent = hands_against_each_other(models)
    for model in models:
        model.plant.SetDefaultPositions(np.zeros(6))
    stretched = hands_against_each_other(models)
    ratio = np.linalg.eigvalsh(stretched)[-1] / np.linalg.eigvalsh(bent)[-1]
    assert 0.1 < ratio < 10.0


def test_a_motion_that_diverges_says_what_was_warned_of() -> None:
    light = InternalGains(np.array(1e-3), np.array(0.1), np.array(2000.0))
    config = CooperativeControllerConfig(internal=bar_internal(translation=light))
    internal = InternalImpedance.of(make_internal(config, models_of()))
    rest = np.eye(19)[0]
    signals = {"desired_motion": rest, "measured_motion": rest, "wrench": np.full(6, 10.0)}
    with pytest.raises(SignalError, match=r"A stiff grasp cannot be held at steps of 0\.001 s"):
        Rig(internal, signals).advance(0.1)
