"""Wrist sensors within the controller of two arms say what sensors beside it say."""

import logging
import re
from collections.abc import Sequence

import numpy as np
import pytest
from geoimp_drake.systems.cooperation.cooperative_control import CooperativeControl
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import Diagram, System

from geoimp_drake.compilation.compiled import is_available
from geoimp_drake.controllers import cooperative_controller
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.setups.setup import Setup
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.wrist_sensor_config import WristSensor
from geoimp_drake.simulation.run import simulate

pytestmark = pytest.mark.skipif(not is_available(), reason="numba is not installed")

NAME = "seven_six_cooperative_controller"
LISTS = {
    "reaction_forces",
    "body_poses",
    "body_spatial_velocities",
    "body_spatial_accelerations",
}
CONFIGS = {
    "follows the reference": (),
    "moves as the plant": ("sensor.inertial_load=plant",),
    "weight alone": ("sensor.inertial_load=none",),
    "erroneous": (
        "sensor.force_noise=0.3",
        "sensor.moment_noise=0.02",
        "sensor.bias=[0.1, 0.2, 0.3, 1, 2, 3]",
        "sensor.force_resolution=0.1",
        "sensor.filter_cutoff=80",
    ),
}


@pytest.fixture
def beside(monkeypatch):
    """Has the sensors beside the controller, as for a period of their own."""

    def choose() -> None:
        monkeypatch.setattr(cooperative_controller, "_periods", lambda sensors: set())

    return choose


def bar(settings: Sequence[str]) -> Setup:
    chosen = get_experiment("bar")
    return chosen.build(chosen.scenario((), ("log_period=0.001", *settings)))


def controller_of(setup: Setup) -> System:
    return setup.diagram.GetSubsystemByName(NAME)


def started(setup: Setup) -> Simulator:
    simulator = Simulator(setup.diagram)
    ApplySimulatorConfig(setup.scenario.simulator, simulator)
    return simulator


def said(setup: Setup, anew: float = 0.02) -> dict[str, np.ndarray]:
    """Returns log and largest readings of a run that is initialized anew after a time."""
    simulator = started(setup)
    simulator.AdvanceTo(anew)
    simulator.Initialize()
    simulator.AdvanceTo(0.05)
    context = simulator.get_context()
    controller = controller_of(setup)
    own = controller.GetMyContextFromRoot(context)
    peaks = {
        port: controller.GetOutputPort(port).Eval(own)
        for port in ("peak_reading_1", "peak_reading_2")
    }
    return {**setup.recorder.collect(context), **peaks}


@pytest.mark.parametrize("name", CONFIGS)
def test_they_say_the_same_to_the_bit(name: str, beside) -> None:
    within = said(bar(CONFIGS[name]))
    beside()
    expected = said(bar(CONFIGS[name]))
    assert within.keys() == expected.keys()
    for key, value in expected.items():
        np.testing.assert_array_equal(within[key], value, err_msg=key)
    assert within["peak_reading_2"].max() > 0.0


def test_a_second_run_of_the_same_diagram_is_the_same() -> None:
    setup = bar(CONFIGS["erroneous"])
    first, second = said(setup), said(setup)
    for key, value in first.items():
        np.testing.assert_array_equal(second[key], value, err_msg=key)


def test_an_opening_grasp_is_seen_at_the_same_sample(beside) -> None:
    def opening() -> dict[str, np.ndarray]:
        setup = bar(("release=0.05", "monitor.force_threshold=1"))
        outcome = simulate(setup.diagram, setup.scenario.simulator, 0.12, events=setup.events)
        assert outcome.failure is None
        return setup.recorder.collect(outcome.context)

    within = opening()
    beside()
    expected = opening()
    assert within["grasp/opened"][-1, 2] > 0.05
    for key, value in expected.items():
        np.testing.assert_array_equal(within[key], value, err_msg=key)


def test_true_wrenches_are_those_of_a_sensor_without_errors() -> None:
    log = said(bar(CONFIGS["erroneous"]))
    for arm in ("seven", "six"):
        assert np.abs(log[f"{arm}/wrench"] - log[f"{arm}/wrench_true"]).max() > 0.5
    ideal = said(bar(()), anew=0.0)
    for arm in ("seven", "six"):
        np.testing.assert_allclose(ideal[f"{arm}/wrench"], ideal[f"{arm}/wrench_true"], atol=1e-9)


def inputs(system: System) -> set[str]:
    ports = map(system.get_input_port, range(system.num_input_ports()))
    return {port.get_name() for port in ports}


@pytest.mark.parametrize(
    ("name", "lists"),
    [
        ("follows the reference", {"reaction_forces"}),
        ("moves as the plant", LISTS - {"body_poses"}),
    ],
)
def test_only_what_the_sensors_read_is_asked_of_the_plant(name: str, lists: set[str]) -> None:
    controller = controller_of(bar(CONFIGS[name]))
    assert isinstance(controller, CooperativeControl)
    assert inputs(controller) == lists | {
        "state",
        "estimated_state_1",
        "estimated_state_2",
        "desired_motion",
        "stiffness_scale",
    }
    assert controller.HasOutputPort("wrench_1")
    assert not controller.HasOutputPort("last_reference_motion_1")


@pytest.mark.parametrize("settings", [("sensor.period=0.002",), ("form=blocks",)])
def test_otherwise_they_are_a_system_of_their_own(settings: tuple[str, ...]) -> None:
    one, other = bar(()), bar(settings)
    controller = controller_of(other)
    assert isinstance(controller, Diagram)
    names = [system.get_name() for system in controller.GetSystems()]
    assert names == ["control", "wrist_sensors"]
    ports = [
        [system.get_output_port(k).get_name() for k in range(system.num_output_ports())]
        for system in map(controller_of, (one, other))
    ]
    assert ports[0] == ports[1]
    assert inputs(controller) == inputs(controller_of(one)) | LISTS
    if "form=blocks" in settings:
        ours, theirs = said(one), said(other)
        for key, value in theirs.items():
            np.testing.assert_allclose(ours[key], value, rtol=1e-7, atol=1e-8, err_msg=key)
    else:
        started(other).AdvanceTo(0.01)


@pytest.mark.parametrize("where", ["within", "beside"])
def test_saturation_is_said_once_of_each_axis_of_each_sensor(where: str, caplog, beside) -> None:
    if where == "beside":
        beside()
    # What carries the bar alone feels a moment that grows after the grasp has opened.
    setup = bar(("sensor.force_range=5", "sensor.moment_range=4", "release=0.02"))
    with caplog.at_level(logging.WARNING, logger="drake"):
        simulate(setup.diagram, setup.scenario.simulator, 0.06, events=setup.events)
    messages = [message for message in caplog.messages if "saturates" in message]
    pattern = r"(\w+) saturates at t = ([0-9.]+) s: ([a-z]+ [xyz]) is"
    found = [match.groups() for match in (re.match(pattern, text) for text in messages) if match]
    assert len(found) == len(messages)
    axes = [(sensor, axis) for sensor, _, axis in found]
    assert len(axes) == len(set(axes))
    times = {axis: float(time) for sensor, time, axis in found if sensor == "seven_wrist_sensor"}
    assert times["moment y"] > times["force x"] + 0.01


def test_the_true_wrench_follows_the_plant() -> None:
    setup = bar(())
    simulator = started(setup)
    simulator.AdvanceTo(0.01)
    context = simulator.get_mutable_context()
    controller = controller_of(setup)
    port, own = controller.GetOutputPort("wrench_true_2"), controller.GetMyContextFromRoot(context)
    before = port.Eval(own)
    plant_context = setup.plant.GetMyMutableContextFromRoot(context)
    setup.plant.SetPositions(plant_context, setup.plant.GetPositions(plant_context) + 0.1)
    assert np.abs(port.Eval(own) - before).max() > 0.1


def test_one_sensor_for_two_hands_is_refused(monkeypatch) -> None:
    real = cooperative_controller.make_cooperative_controller

    def with_one(*arguments, sensors: Sequence[WristSensor], **options) -> System:
        return real(*arguments, sensors=sensors[:1], **options)

    monkeypatch.setattr("geoimp_drake.diagrams.setups.tight.make_cooperative_controller", with_one)
    with pytest.raises(ConfigurationError, match="There are 1 sensors; give one per hand, or none"):
        bar(())
