"""A wrist sensor under its controller: stable by default on any arm, said where it is not."""

import logging
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, ModelInstanceIndex, SpatialInertia, WeldJoint
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from two_arms import add_arms

from geoimp_drake import (
    ImpedanceControllerConfig,
    WristSensorConfig,
    add_wrist_sensor,
    add_wrist_sensors,
    connect_wrist_sensors,
    find_start_posture,
    load_robot,
    make_impedance_controller,
    wrist_sensor_at,
)
from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError, ModelError
from geoimp_drake.models import model_path
from geoimp_drake.parts.wrist_sensor_config import SensorMounting, ToolLoad, WristSensor
from geoimp_drake.systems.frame_motion import frame_motion_at_rest

CASES = Path(__file__).parents[1] / "robot_files" / "cases"
POSTURE = [0.1225, -0.3789, 1.0966, 0.0, -0.7177, -1.4483]


@dataclass
class Hand:
    plant: MultibodyPlant
    arm: ModelInstanceIndex
    E: Frame
    wrist: Joint

    def sensor(self, **fields) -> WristSensor:
        return wrist_sensor_at(self.plant, self.wrist, self.E, WristSensorConfig(**fields))


def published(plant: MultibodyPlant, name: str, share: float = 1.0) -> Hand:
    """A light arm whose last link is cut for the sensor; its last rotor has the rest of it."""
    offset = RigidTransform([0.0, 0.0, 0.1])
    robot = load_robot(CASES / f"{name}.urdf", plant, end_effector=f"l{name[-1]}", offset=offset)
    rotor = plant.get_joint_actuator(plant.GetJointActuatorIndices()[-1])
    rotor.set_default_gear_ratio(1.0)
    rotor.set_default_rotor_inertia(2e-4 * (1.0 - share) / share)
    plant.Finalize()
    arm, E = robot.model_instance, robot.end_effector_frame
    model = ControlModel.of_arm(plant, arm, E)
    plant.SetDefaultPositions(arm, model.in_plant_order(np.array(find_start_posture(model))))
    return Hand(plant, arm, E, robot.sensor_joint)


def own(plant: MultibodyPlant, mass: float) -> Hand:
    """The library's arm and disk, with a weight at the disk's stick."""
    (arm,) = Parser(plant).AddModels(model_path("six_joint_arm"))
    (tool,) = Parser(plant).AddModels(model_path("stick_and_disk"))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base", arm))
    stick = plant.GetBodyByName("tool", tool).body_frame()
    flange = plant.GetFrameByName("flange", arm)
    wrist = plant.AddJoint(WeldJoint("wrist", flange, stick, RigidTransform()))
    weight = plant.AddRigidBody("weight", tool, SpatialInertia.SolidSphereWithMass(mass, 0.06))
    plant.WeldFrames(stick, weight.body_frame(), RigidTransform([0.0, 0.0, 0.1]))
    plant.Finalize()
    plant.SetDefaultPositions(arm, POSTURE)
    return Hand(plant, arm, plant.GetFrameByName("disk", tool), wrist)


def light_gains() -> ImpedanceControllerConfig:
    """Those of the documentation's scenario for a robot of one's own."""
    config = ImpedanceControllerConfig(form="compiled")
    translation, rotation = config.impedance.translation, config.impedance.rotation
    translation.mass, translation.damping, translation.stiffness = map(
        np.array, (5.0, 200.0, 500.0)
    )
    rotation.mass, rotation.damping, rotation.stiffness = map(np.array, (0.2, 4.0, 10.0))
    return config


ARMS = {
    "light6, all of the last joint's": lambda plant: published(plant, "light6"),
    "light7, all of the last joint's": lambda plant: published(plant, "light7"),
    "light6, 96 % of the last joint's": lambda plant: published(plant, "light6", 0.96),
    "light6, 98 % of the last joint's": lambda plant: published(plant, "light6", 0.98),
    "own arm, 4 kg": lambda plant: own(plant, 4.0),
    "own arm, 12 kg": lambda plant: own(plant, 12.0),
}
# Scheme, arm, inertial load, and whether the loop is stable.
LOOPS = [
    *(("inner-loop", arm, "plant", True) for arm in ARMS),
    ("inner-loop", "light6, all of the last joint's", "none", False),
    ("inner-loop", "light6, all of the last joint's", "reference", False),
    ("inner-loop", "light7, all of the last joint's", "none", False),
    ("inner-loop", "light6, 96 % of the last joint's", "none", True),
    ("inner-loop", "light6, 96 % of the last joint's", "reference", True),
    ("inner-loop", "light6, 98 % of the last joint's", "reference", False),
    ("inner-loop", "own arm, 4 kg", "none", True),
    ("inner-loop", "own arm, 12 kg", "none", False),
    ("inner-loop", "own arm, 12 kg", "reference", True),
    ("direct", "light6, all of the last joint's", "plant", True),
    # These two are unstable with an inner loop.
    ("direct", "light6, 98 % of the last joint's", "none", True),
    ("direct", "light6, 98 % of the last joint's", "reference", True),
    ("direct", "own arm, 12 kg", "none", False),
]


@pytest.mark.parametrize(("scheme", "arm", "load", "stable"), LOOPS)
def test_a_loop_is_warned_of_when_it_is_made_and_only_if_its_motions_grow(
    caplog, scheme: str, arm: str, load: str, stable: bool
) -> None:
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    hand = ARMS[arm](plant)
    caplog.clear()
    config = light_gains()
    config.scheme = scheme
    with caplog.at_level(logging.WARNING, logger="drake"):
        controller = builder.AddSystem(
            make_impedance_controller(
                plant, hand.arm, hand.E, config, sensor=hand.sensor(inertial_load=load)
            )
        )
    said = [record.message for record in caplog.records if "unstable" in record.message]
    assert len(said) == (not stable)
    connect_wrist_sensors(builder, plant, controller)
    state = plant.get_state_output_port(hand.arm)
    builder.Connect(state, controller.GetInputPort("estimated_state"))
    builder.Connect(controller.GetOutputPort("actuation"), plant.get_actuation_input_port(hand.arm))
    builder.ExportInput(controller.GetInputPort("desired_motion"), "desired_motion")
    diagram = builder.Build()
    simulator = Simulator(diagram)
    ApplySimulatorConfig(
        SimulatorConfig(
            integration_scheme="explicit_euler", max_step_size=1e-3, use_error_control=False
        ),
        simulator,
    )
    context = simulator.get_mutable_context()
    X_WE = hand.E.CalcPoseInWorld(plant.CreateDefaultContext())
    X_ED = RigidTransform(RollPitchYaw(0.01, 0.01, 0.02), [0.002, 0.001, -0.002])
    diagram.GetInputPort("desired_motion").FixValue(context, frame_motion_at_rest(X_WE @ X_ED))

    def largest(until: float) -> float:
        readings = []
        while context.get_time() < until - 5e-4:
            simulator.AdvanceTo(context.get_time() + 1e-3)
            own = controller.GetMyContextFromRoot(context)
            readings.append(np.abs(controller.GetOutputPort("wrench").Eval(own)).max())
        return max(readings)

    largest(0.1)
    early = largest(0.2)
    largest(0.5)
    late = largest(0.6)
    print(f"\n{arm}, {load}: {early:.2e} then {late:.2e}")
    assert (late < 0.7 * early) == stable


def test_separate_sensors_are_warned_of_with_share_growth_and_remedy(caplog) -> None:
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    hand = published(plant, "light6")
    caplog.clear()
    with caplog.at_level(logging.WARNING, logger="drake"):
        add_wrist_sensor(builder, plant, hand.wrist, hand.E)
    assert not caplog.records
    with caplog.at_level(logging.WARNING, logger="drake"):
        none = WristSensorConfig(inertial_load="none")
        add_wrist_sensor(builder, plant, hand.wrist, hand.E, none)
        add_wrist_sensors(builder, plant, [hand.sensor(inertial_load="reference")])
    assert len(caplog.records) == 2
    for part in ("robot_wrist_sensor carries 100.0 %", "1.7 % in a step of 1 ms", "to 'plant'"):
        assert part in caplog.text


def test_a_slower_reading_makes_a_loop_unstable_that_a_quick_one_does_not(caplog) -> None:
    hand = published(MultibodyPlant(1e-3), "light6", 0.9)
    caplog.clear()
    for period, warnings in ((1e-3, 0), (4e-3, 1)):
        config = light_gains()
        config.sampling.period = period
        sensor = hand.sensor(inertial_load="reference", period=period)
        make_impedance_controller(hand.plant, hand.arm, hand.E, config, sensor=sensor)
        assert len(caplog.records) == warnings


def test_what_is_not_compliant_does_not_move_with_the_reading(caplog) -> None:
    hand = own(MultibodyPlant(1e-3), 12.0)
    caplog.clear()
    config = light_gains()
    for axes, warnings in (("none", 0), ("rotation", 0), ("translation", 1)):
        config.impedance.axes = axes
        sensor = hand.sensor(inertial_load="none")
        make_impedance_controller(hand.plant, hand.arm, hand.E, config, sensor=sensor)
        assert len(caplog.records) == warnings, axes


def test_natural_inertia_is_not_moved_by_the_reading(caplog) -> None:
    hand = own(MultibodyPlant(1e-3), 12.0)
    config = ImpedanceControllerConfig(scheme="direct", inertia="natural")
    caplog.clear()
    sensor = hand.sensor(inertial_load="none", period=1.0)  # too slow for another
    assert make_impedance_controller(hand.plant, hand.arm, hand.E, config, sensor=sensor)
    assert not caplog.records


def test_a_sensor_of_another_frame_is_refused() -> None:
    hand = own(MultibodyPlant(1e-3), 1.0)
    flange_side = hand.plant.GetFrameByName("tool")
    sensor = wrist_sensor_at(hand.plant, hand.wrist, flange_side)
    with pytest.raises(ModelError, match=r"'stick_and_disk::tool', but the.*disk'"):
        make_impedance_controller(hand.plant, hand.arm, hand.E, sensor=sensor)


def test_sensors_of_exchanged_hands_are_refused() -> None:
    pair, identity = add_arms(MultibodyPlant(1e-3)), RigidTransform()
    sensors = []
    for E in pair.frames:
        mounting = SensorMounting(
            joint=0,
            tool_body=E.body().index(),
            X_TS=identity,
            X_TE=identity,
            gravity=np.zeros(3),
            end_effector=E.scoped_name().get_full(),
        )
        sensors.append(WristSensor(mounting, ToolLoad(), WristSensorConfig()))
    assert pair.controller(sensors=sensors)
    with pytest.raises(ModelError, match=r"wrench at 'second::.*end effector is 'first::"):
        pair.controller(sensors=sensors[::-1])


@pytest.mark.parametrize("form", ["blocks", "compiled"])
def test_a_sensor_slower_than_impedance_and_inner_loop_is_refused(form: str) -> None:
    hand = own(MultibodyPlant(1e-3), 1.0)
    config = ImpedanceControllerConfig(form=form)
    quick, slow = hand.sensor(period=0.1), hand.sensor(period=1.0)
    assert make_impedance_controller(hand.plant, hand.arm, hand.E, config, sensor=quick)
    with pytest.raises(ConfigurationError, match=r"sensor\.period is 1 s.* = 0\.113 s.*0\.0154 s"):
        make_impedance_controller(hand.plant, hand.arm, hand.E, config, sensor=slow)
    config.scheme = "direct"  # no loop that could be slower
    with pytest.raises(ConfigurationError, match=r"√\(M/K\) = 0\.113 s, which readings as rare"):
        make_impedance_controller(hand.plant, hand.arm, hand.E, config, sensor=slow)
    config.scheme = "inner-loop"
    config.impedance.axes = "rotation"  # √(0.4/2) s
    with pytest.raises(ConfigurationError, match=r"at most 0\.447 s"):
        make_impedance_controller(hand.plant, hand.arm, hand.E, config, sensor=slow)
