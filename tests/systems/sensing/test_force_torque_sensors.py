"""Sensors in one system say what each of them says alone."""

import logging
from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BallRpyJoint,
    FixedOffsetFrame,
    RevoluteJoint,
    SpatialInertia,
    WeldJoint,
)
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from geoimp_drake.controllers.wrist_sensor import (
    add_wrist_sensor,
    add_wrist_sensors,
    wrist_sensor_at,
)
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.wrist_sensor_config import WristSensor, WristSensorConfig
from geoimp_drake.systems.frame_motion import frame_motion_at_rest
from geoimp_drake.systems.sensing.force_torque_sensor import ForceTorqueSensors

PORTS = ("wrench", "wrench_true", "peak_reading")
CONFIGS = {
    "ideal": WristSensorConfig(),
    "plant": WristSensorConfig(inertial_load="plant"),
    "reference": WristSensorConfig(inertial_load="reference"),
    "erroneous": WristSensorConfig(
        force_noise=0.2,
        moment_noise=0.02,
        bias=np.arange(6.0),
        force_resolution=0.1,
        filter_cutoff=80.0,
        seed=3,
    ),
}


def two_pendulums(second_is_ball: bool) -> MultibodyPlant:
    """Returns two swinging rods with a tool welded to each."""
    plant = MultibodyPlant(1e-3)
    inertia = SpatialInertia.SolidBoxWithMass(1.4, 0.05, 0.08, 0.2)
    for k in range(2):
        rod, tool = (plant.AddRigidBody(f"{name}{k}", inertia) for name in ("rod", "tool"))
        X = RigidTransform(RollPitchYaw(0.3, -0.2, 0.5), [0.3 * k, 0.01, 0.06])
        ends = (
            plant.world_frame(),
            plant.AddFrame(FixedOffsetFrame(f"pivot{k}", rod.body_frame(), X)),
        )
        if k and second_is_ball:
            plant.AddJoint(BallRpyJoint(f"hinge{k}", *ends))
        else:
            plant.AddJoint(RevoluteJoint(f"hinge{k}", *ends, [0.0, 0.6, 0.8]))
        plant.AddJoint(WeldJoint(f"wrist{k}", rod.body_frame(), tool.body_frame(), X))
    plant.Finalize()
    return plant


def both_forms(config: WristSensorConfig, *, second_is_ball: bool, held: bool) -> Simulator:
    """Returns pendulums whose sensors are there twice: in one system and one by one."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(two_pendulums(second_is_ball))
    rest = frame_motion_at_rest(RigidTransform())
    sensors = []
    for k in range(2):
        # Neither noise nor what is known of the start is the same.
        own = replace(config, seed=config.seed + k)
        joint, E = plant.GetJointByName(f"wrist{k}"), plant.GetFrameByName(f"tool{k}")
        initial = np.full(6, k + 1.0)
        sensors.append(wrist_sensor_at(plant, joint, E, own, initial_wrench=initial))
        alone = add_wrist_sensor(
            builder, plant, joint, E, own, None, initial, reference_is_held=held
        )
        alone.set_name(f"alone_{k + 1}")
        reference = rest.copy()
        reference[13:] = 0.5 * k + np.arange(6.0)
        source = builder.AddNamedSystem(f"reference_{k + 1}", ConstantVectorSource(reference))
        builder.Connect(source.get_output_port(), alone.GetInputPort("reference_motion"))
    together = add_wrist_sensors(builder, plant, sensors, reference_is_held=held)
    together.set_name("together")
    for k in (1, 2):
        source = builder.GetSubsystemByName(f"reference_{k}")
        port = together.GetInputPort(f"reference_motion_{k}")
        builder.Connect(source.get_output_port(), port)
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetPositions(context, np.linspace(0.3, -0.7, plant.num_positions()))
    return simulator


def said(simulator: Simulator, name: str, port: str) -> np.ndarray:
    system = simulator.get_system().GetSubsystemByName(name)
    context = system.GetMyContextFromRoot(simulator.get_context())
    return system.GetOutputPort(port).Eval(context).copy()


@pytest.mark.parametrize("second_is_ball", [False, True])
@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("name", CONFIGS)
def test_together_they_say_the_same_to_the_bit(name: str, held: bool, second_is_ball: bool) -> None:
    simulator = both_forms(CONFIGS[name], second_is_ball=second_is_ball, held=held)
    for step in (0, 1, 2, 3, 40):
        simulator.AdvanceTo((step + 0.5) * 1e-3)
        seen = {
            (port, k): said(simulator, "together", f"{port}_{k}") for port in PORTS for k in (1, 2)
        }
        for (port, k), value in seen.items():
            np.testing.assert_array_equal(value, said(simulator, f"alone_{k}", port))
    # Each has its own: the second is neither the first nor what it was told at the start.
    assert np.abs(seen["wrench", 1] - seen["wrench", 2]).max() > 1e-3
    assert np.abs(seen["wrench", 2] - 2.0).min() > 1e-6


@pytest.mark.parametrize("held", [False, True])
def test_each_takes_its_own_reference(held: bool) -> None:
    seen = {}
    for name in ("ideal", "reference"):
        simulator = both_forms(CONFIGS[name], second_is_ball=False, held=held)
        simulator.AdvanceTo(0.0035)
        seen[name] = [said(simulator, "together", f"wrench_{k}") for k in (1, 2)]
    # The references' accelerations differ by 0.5 m/s² on every axis, the tools weigh 1.4 kg.
    for k in range(2):
        removed = (seen["ideal"][k] - seen["reference"][k])[3:] / 1.4
        assert np.linalg.norm(removed) > 5.0
        rest = removed - (0.5 * k + np.arange(3.0, 6.0))
        # What is left is the turn about the tool's centre: ω̇ × p.
        assert np.linalg.norm(rest) < 2.0


def test_which_one_saturates_is_said(caplog) -> None:
    plant = two_pendulums(second_is_ball=False)
    builder = DiagramBuilder()
    builder.AddSystem(plant)
    sensors = [
        wrist_sensor_at(
            plant,
            plant.GetJointByName(f"wrist{k}"),
            plant.GetFrameByName(f"tool{k}"),
            WristSensorConfig(force_range=1.0 if k else np.inf),
            name=("left", "right")[k],
        )
        for k in range(2)
    ]
    add_wrist_sensors(builder, plant, sensors)
    with caplog.at_level(logging.WARNING, logger="drake"):
        Simulator(builder.Build()).AdvanceTo(0.005)
    assert caplog.messages
    assert all(message.startswith("right saturates") for message in caplog.messages)


def test_sensors_of_one_system_have_one_period() -> None:
    plant = two_pendulums(second_is_ball=False)
    sensors = [
        wrist_sensor_at(
            plant,
            plant.GetJointByName(f"wrist{k}"),
            plant.GetFrameByName(f"tool{k}"),
            WristSensorConfig(period=(k + 1) * 1e-3),
        )
        for k in range(2)
    ]
    with pytest.raises(ConfigurationError, match=r"0\.001, 0\.002.*one by one"):
        ForceTorqueSensors(sensors)


def test_no_sensor_is_refused() -> None:
    none: list[WristSensor] = []
    with pytest.raises(ConfigurationError, match="no sensor"):
        ForceTorqueSensors(none)
