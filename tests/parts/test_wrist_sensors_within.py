"""Wrist sensors within the controller of two arms say the same in both of its forms."""

import logging
import re
from collections.abc import Sequence

import numpy as np
import pytest
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder, System
from two_arms import FORMS

from geoimp_drake.controllers import cooperative_controller
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.setups.setup import Setup
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.wrist_sensor_config import WristSensor
from geoimp_drake.simulation.run import simulate
from geoimp_drake.systems.sensing.force_torque_sensor import ForceTorqueSensors

SAME = 1e-11  # relative to the largest entry of a signal
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
    "read every 2 ms": ("sensor.period=0.002",),
    "read twice a step": ("sensor.period=0.0005", "sensor.inertial_load=plant"),
    "erroneous": (
        "sensor.force_noise=0.3",
        "sensor.moment_noise=0.02",
        "sensor.bias=[0.1, 0.2, 0.3, 1, 2, 3]",
        "sensor.force_resolution=0.1",
        "sensor.filter_cutoff=80",
    ),
}


def bar(settings: Sequence[str] = (), form: str = "compiled") -> Setup:
    chosen = get_experiment("bar")
    return chosen.build(chosen.scenario((), ("log_period=0.001", f"form={form}", *settings)))


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


def assert_the_same(ours: dict[str, np.ndarray], others: dict[str, np.ndarray]) -> None:
    assert ours.keys() == others.keys()
    for key, value in others.items():
        away = np.abs(ours[key] - value).max() / max(np.abs(value).max(), 1e-2)
        assert away < SAME, f"{key}: {away:.1e}"


@pytest.mark.parametrize("name", CONFIGS)
def test_both_forms_say_the_same(name: str) -> None:
    compiled, blocks = (said(bar(CONFIGS[name], form)) for form in FORMS)
    assert_the_same(compiled, blocks)
    assert compiled["peak_reading_2"].max() > 0.0


@pytest.mark.parametrize("form", FORMS)
def test_beside_the_controller_they_say_the_same(form: str, monkeypatch) -> None:
    """With what the controller followed when the last step began."""
    within = said(bar(form=form))

    def beside(*arguments, sensors: Sequence[WristSensor], **options) -> System:
        builder = DiagramBuilder()
        made = cooperative_controller.make_cooperative_controller(*arguments, **options)
        controller = builder.AddSystem(made)
        wrists = builder.AddSystem(ForceTorqueSensors(sensors, reference_is_held=True))
        for ours, output, theirs, target in (
            (wrists, "wrench", controller, "wrench"),
            (controller, "last_reference_motion", wrists, "reference_motion"),
        ):
            for k in (1, 2):
                port = theirs.GetInputPort(f"{target}_{k}")
                builder.Connect(ours.GetOutputPort(f"{output}_{k}"), port)
        for system in (controller, wrists):
            for name in inputs(system):
                if not builder.IsConnectedOrExported(system.GetInputPort(name)):
                    builder.ExportInput(system.GetInputPort(name), name)
            for k in range(system.num_output_ports()):
                port = system.get_output_port(k)
                builder.ExportOutput(port, port.get_name())
        diagram = builder.Build()
        diagram.set_name(NAME)
        return diagram

    monkeypatch.setattr("geoimp_drake.diagrams.setups.tight.make_cooperative_controller", beside)
    setup = bar(form=form)
    assert controller_of(setup).HasOutputPort("last_reference_motion_1")
    assert_the_same(said(setup), within)


@pytest.mark.parametrize("form", FORMS)
def test_a_second_run_of_the_same_diagram_is_the_same(form: str) -> None:
    setup = bar(CONFIGS["erroneous"], form)
    first, second = said(setup), said(setup)
    for key, value in first.items():
        np.testing.assert_array_equal(second[key], value, err_msg=key)


@pytest.mark.parametrize("form", FORMS)
def test_initialization_forgets_the_wrench_until_the_first_sample(form: str) -> None:
    setup = bar(form=form)
    simulator, controller = started(setup), controller_of(setup)

    def read(port: str) -> np.ndarray:
        own = controller.GetMyContextFromRoot(simulator.get_context())
        return controller.GetOutputPort(port).Eval(own).copy()

    def everything() -> list[np.ndarray]:
        return [read(f"{port}_2") for port in ("wrench", "wrench_true", "peak_reading")]

    simulator.Initialize()
    initial = everything()
    assert initial[0][5] > 5.0  # half of the bar
    simulator.AdvanceTo(0.0205)
    for before, port in zip(initial, everything(), strict=True):
        assert np.abs(port - before).max() > 1e-3
    simulator.Initialize()
    for before, port in zip(initial, everything(), strict=True):
        np.testing.assert_array_equal(port, before)


def test_an_opening_grasp_is_seen_at_the_same_sample() -> None:
    def opening(form: str) -> dict[str, np.ndarray]:
        setup = bar(("release=0.05", "monitor.force_threshold=1"), form)
        outcome = simulate(setup.diagram, setup.scenario.simulator, 0.12, events=setup.events)
        assert outcome.failure is None
        return setup.recorder.collect(outcome.context)

    compiled, blocks = map(opening, FORMS)
    assert compiled["grasp/opened"][-1, 2] > 0.05
    np.testing.assert_array_equal(compiled["grasp/opened"], blocks["grasp/opened"])
    assert_the_same(compiled, blocks)


def test_true_wrenches_are_those_of_a_sensor_without_errors() -> None:
    log = said(bar(CONFIGS["erroneous"]))
    for arm in ("seven", "six"):
        assert np.abs(log[f"{arm}/wrench"] - log[f"{arm}/wrench_true"]).max() > 0.5
    ideal = said(bar(), anew=0.0)
    for arm in ("seven", "six"):
        # The first sample is taken a period after the start; the true wrench is there before.
        read, true = ideal[f"{arm}/wrench"][3:], ideal[f"{arm}/wrench_true"][3:]
        np.testing.assert_allclose(read, true, atol=1e-9)


def inputs(system: System) -> set[str]:
    ports = map(system.get_input_port, range(system.num_input_ports()))
    return {port.get_name() for port in ports}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("name", "lists"),
    [
        ("follows the reference", {"reaction_forces"}),
        ("moves as the plant", LISTS - {"body_poses"}),
    ],
)
def test_only_what_the_sensors_read_is_asked_of_the_plant(
    name: str, lists: set[str], form: str
) -> None:
    controller = controller_of(bar(CONFIGS[name], form))
    assert inputs(controller) == lists | {
        "state",
        "estimated_state_1",
        "estimated_state_2",
        "desired_motion",
        "stiffness_scale",
    }
    assert controller.HasOutputPort("wrench_1")
    assert not controller.HasOutputPort("last_reference_motion_1")


def test_among_the_blocks_they_are_one_block() -> None:
    blocks = controller_of(bar(form="blocks"))
    assert isinstance(blocks, Diagram)
    assert isinstance(blocks.GetSubsystemByName("wrist_sensors"), ForceTorqueSensors)
    ports = [
        [system.get_output_port(k).get_name() for k in range(system.num_output_ports())]
        for system in (blocks, controller_of(bar()))
    ]
    assert ports[0] == ports[1]


@pytest.mark.parametrize("form", FORMS)
def test_saturation_is_said_once_of_each_axis_of_each_sensor(form: str, caplog) -> None:
    # What carries the bar alone feels a moment that grows after the grasp has opened.
    setup = bar(("sensor.force_range=5", "sensor.moment_range=4", "release=0.02"), form)
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
    setup = bar()
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
        bar()
