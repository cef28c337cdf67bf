"""State lives in the context: clones and simulators side by side do not know of each other."""

import numpy as np
import pytest
from pydrake.systems.analysis import (
    ApplySimulatorConfig,
    InitializeParams,
    Simulator,
    SimulatorConfig,
)
from pydrake.systems.framework import Context
from rigs import ControlledArm, make_controlled_arm, quick_config

from geoimp_drake.parts.wrist_sensor_config import WristSensorConfig

STEPS = 40
PUSHES = {"one": np.array([30.0, 0.0, -10.0]), "other": np.array([-15.0, 25.0, 0.0])}


def pushed_arm(push: np.ndarray) -> ControlledArm:
    """Returns an arm with a noisy, filtered sensor and differenced velocities, pushed."""
    sensor = WristSensorConfig(force_noise=0.1, moment_noise=0.01, filter_cutoff=100.0, seed=5)
    arm = make_controlled_arm(7, quick_config("differenced"), sensor_config=sensor)
    arm.push(push)
    return arm


def all_state(context: Context) -> np.ndarray:
    discrete = context.get_discrete_state()
    groups = [discrete.get_vector(k).value() for k in range(discrete.num_groups())]
    return np.concatenate((context.get_continuous_state_vector().CopyToVector(), *groups))


def advanced(simulator: Simulator, first: int, last: int) -> np.ndarray:
    """Advances in steps of 1 ms; returns the state after each, one a row."""
    rows = []
    for k in range(first + 1, last + 1):
        simulator.AdvanceTo(k * 1e-3)
        rows.append(all_state(simulator.get_context()))
    return np.array(rows)


def another_simulator(arm: ControlledArm, context: Context) -> Simulator:
    """Returns a simulator of the same diagram on a context that goes on where it is."""
    simulator = Simulator(arm.diagram, context)
    config = SimulatorConfig(
        integration_scheme="runge_kutta2",
        max_step_size=1e-3,
        use_error_control=False,
        start_time=context.get_time(),
    )
    ApplySimulatorConfig(config, simulator)
    return simulator


@pytest.fixture(scope="module")
def alone() -> dict[str, np.ndarray]:
    """The runs of each arm by itself."""
    return {name: advanced(pushed_arm(push).simulator, 0, STEPS) for name, push in PUSHES.items()}


def test_runs_alone_differ_and_move(alone) -> None:
    assert np.abs(alone["one"] - alone["other"]).max() > 1e-3
    assert np.abs(alone["one"][-1] - alone["one"][0]).max() > 1e-3


def test_a_run_again_gives_the_same_to_the_bit(alone) -> None:
    again = advanced(pushed_arm(PUSHES["one"]).simulator, 0, STEPS)
    np.testing.assert_array_equal(again, alone["one"])


def test_two_diagrams_in_one_process_turn_by_turn_do_not_disturb_each_other(alone) -> None:
    arms = {name: pushed_arm(push) for name, push in PUSHES.items()}
    rows: dict[str, list] = {name: [] for name in PUSHES}
    for k in range(STEPS):
        for name, arm in arms.items():
            rows[name].append(advanced(arm.simulator, k, k + 1)[0])
    for name, expected in alone.items():
        np.testing.assert_array_equal(np.array(rows[name]), expected)


def test_two_simulators_of_one_diagram_turn_by_turn_do_not_disturb_each_other(alone) -> None:
    arm = pushed_arm(PUSHES["one"])
    other = another_simulator(arm, arm.context.Clone())
    first = arm.simulator
    arm.simulator = other
    arm.push(PUSHES["other"])
    rows: dict[str, list] = {name: [] for name in PUSHES}
    for k in range(STEPS):
        rows["one"].append(advanced(first, k, k + 1)[0])
        rows["other"].append(advanced(other, k, k + 1)[0])
    for name, expected in alone.items():
        np.testing.assert_array_equal(np.array(rows[name]), expected)


def test_ports_of_a_clone_say_what_those_of_the_original_say() -> None:
    arm = pushed_arm(PUSHES["one"])
    advanced(arm.simulator, 0, 10)
    clone = arm.context.Clone()
    here = {port: arm.read(port) for port in ("actuation", "compliant_motion", "energy")}
    advanced(arm.simulator, 10, 20)  # the original goes on, its scratch with it
    context = arm.controller.GetMyContextFromRoot(clone)
    for port, expected in here.items():
        np.testing.assert_array_equal(
            arm.controller.GetOutputPort(port).Eval(context), expected, err_msg=port
        )
        assert np.abs(arm.read(port) - expected).max() > 1e-9


def test_a_clone_goes_on_as_the_original_does() -> None:
    arm = pushed_arm(PUSHES["one"])
    advanced(arm.simulator, 0, 20)
    clone = arm.context.Clone()
    expected = advanced(arm.simulator, 20, STEPS)
    restarted = another_simulator(arm, clone)
    # Initialization events would put C on E: this is the same run, not another one.
    restarted.Initialize(InitializeParams(suppress_initialization_events=True))
    np.testing.assert_array_equal(advanced(restarted, 20, STEPS), expected)
