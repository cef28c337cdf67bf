"""The scheme admittance on joint servos: a push, a wall, both forms, tick by tick, limits."""

import importlib.util
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from arms import make_arm_plant
from port_values import largest_difference, ports
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from rigs import K_P, ControlledArm, quick_config

from geoimp_drake.controllers.admittance_controller import AdmittanceLoop
from geoimp_drake.controllers.config import FORMS, ImpedanceControllerConfig
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.controllers.wrist_sensor import add_wrist_sensor
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.systems.arm.industrial_controller import (
    IndustrialControllerConfig,
    make_industrial_controller,
)
from geoimp_drake.systems.frame_motion import frame_motion_at_rest
from geoimp_drake.task_functions.config import TaskConfig
from geoimp_drake.validation import check

PUSH = np.array([15.0, 0.0, 0.0])


def config_of(period: float = 1e-3, form: str = "compiled") -> ImpedanceControllerConfig:
    config = quick_config()
    config.scheme, config.form, config.sampling.period = "admittance", form, period
    return config


def on_servos(joints: int, period: float, form: str = "compiled", **options) -> ControlledArm:
    """Wires plant, sensor, controller and servos as a user would."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    rig = make_arm_plant(plant, joints, **options)
    own = plant, rig.arm, rig.E
    controller = builder.AddSystem(make_impedance_controller(*own, config_of(period, form)))
    servos = builder.AddSystem(
        make_industrial_controller(*own, None, IndustrialControllerConfig(period=period))
    )
    sensor = add_wrist_sensor(builder, plant, rig.wrist, rig.E)
    state = plant.get_state_output_port(rig.arm)
    for source, target in (
        (state, controller.GetInputPort("estimated_state")),
        (state, servos.GetInputPort("estimated_state")),
        (sensor.GetOutputPort("wrench"), controller.GetInputPort("wrench")),
        (controller.GetOutputPort("joint_reference"), servos.GetInputPort("joint_reference")),
        (servos.GetOutputPort("actuation"), plant.get_actuation_input_port(rig.arm)),
    ):
        builder.Connect(source, target)
    builder.ExportInput(controller.GetInputPort("desired_motion"), "desired_motion")
    builder.ExportInput(plant.get_applied_spatial_force_input_port(), "push")
    simulator = Simulator(builder.Build())
    config = SimulatorConfig(
        integration_scheme="runge_kutta2", max_step_size=1e-3, use_error_control=False
    )
    ApplySimulatorConfig(config, simulator)
    diagram = simulator.get_system()
    arm = ControlledArm(rig, diagram, controller, sensor, simulator, RigidTransform())
    arm.X_WD = arm.pose()
    diagram.GetInputPort("desired_motion").FixValue(arm.context, frame_motion_at_rest(arm.X_WD))
    arm.push(PUSH)
    return arm


@pytest.mark.parametrize(
    ("joints", "period", "form"),
    [(6, 1e-3, "blocks"), (7, 4e-3, "compiled"), (6, 8e-3, "compiled")],
)
def test_a_push_moves_the_hand_by_the_force_over_the_stiffness(joints, period, form):
    order = {6: [4, 2, 6, 1, 3, 5], 7: [7, 2, 5, 1, 3, 4, 6]}[joints]
    arm = on_servos(joints, period, form, actuator_order=order)
    arm.simulator.AdvanceTo(2.5)
    way, right = arm.pose().translation() - arm.X_WD.translation(), np.linalg.solve(K_P, PUSH)
    assert np.linalg.norm(way - right) < 1e-4 * np.linalg.norm(right)  # 2e-5
    assert np.abs(arm.read("reference_error")).max() < 1e-7


@pytest.mark.parametrize("joints", [6, 7])
def test_both_forms_have_the_same_ports_and_numbers(joints):
    arms = [on_servos(joints, 4e-3, form) for form in FORMS]
    for time in (0.0, 0.05, 0.1):
        for arm in arms:
            arm.simulator.AdvanceTo(time)
        values = [ports(a.controller, a.controller.GetMyContextFromRoot(a.context)) for a in arms]
        assert set(values[0]) == set(values[1])
        assert largest_difference(*values) < 1e-9


@cache
def study() -> ModuleType:
    """The script that draws the page's figure."""
    path = Path(__file__).parents[2] / "docs" / "validation" / "studies"
    spec = importlib.util.spec_from_file_location("study", path / "admittance_stability.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@cache
def trial():
    return study().Trial()


def test_the_force_on_a_stiff_wall_is_that_of_two_springs_in_series():
    K, K_e = study().K, 1e4
    force = trial().pressed(study().Point(400.0, K_e, 8e-3))[-1]
    assert abs(force / (K * K_e / (K + K_e) * study().DEPTH) - 1.0) < 0.03  # 4e-4


@pytest.mark.parametrize("damping", [400.0, 1600.0])
def test_a_stiff_wall_is_stable_at_8_ms_from_400_on(damping):
    point = study().Point(damping, 1e4, 8e-3)
    assert trial().predicted(point) < 1.0
    assert trial().rests(point)


@pytest.mark.parametrize("look_ahead", [0.0, 30e-3])
@pytest.mark.parametrize(("wall", "period"), [(1e4, 8e-3), (1e5, 4e-3)])
def test_the_map_says_what_a_simulation_does(wall, period, look_ahead):
    contact = {"wall": wall, "period": period, "look_ahead": look_ahead}
    least = trial().least(trial().predicted, **contact)
    below, above = study().around(least, contact)
    assert not trial().rests(below)
    assert trial().rests(above)


def still(joints: int = 7):
    rig = make_arm_plant(joints=joints)
    return (rig.plant, rig.arm, rig.E), rig.plant.GetDefaultPositions(rig.arm), np.zeros(joints)


def test_the_loop_gives_positions_and_velocities_in_the_robots_order():
    own, q, v = still()
    names = ControlLoop(*own).joints.names
    wrench = np.array([0.5, 0.2, -0.3, 20.0, -5.0, 3.0])
    found = []
    for order in (names, names[::-1]):
        loop, turn = AdmittanceLoop(*own, config_of(), joints=order), slice(None, None, 1)
        if order != names:
            turn = slice(None, None, -1)
        start = loop.reset(q[turn], v)
        np.testing.assert_array_equal(start.positions, q[turn])
        desired = frame_motion_at_rest(loop.pose(q[turn]))
        for _ in range(500):
            reference = loop.step(q[turn], v, wrench, desired)
        found.append([value[turn] for value in reference])
        pose = loop.pose(reference.positions).translation()
        assert np.linalg.norm(pose - loop.output("compliant_motion")[4:7]) < 1e-4
    np.testing.assert_allclose(*found, atol=1e-12)


def test_a_reference_stays_within_the_joints_limits_and_says_so(caplog):
    """D goes 0.5 m away in a jump; with limits no joint is faster than it may be."""
    own, q, v = still(6)
    speeds = []
    for limited in (True, False):
        config = config_of()
        if not limited:
            config.limits = None
        loop = AdmittanceLoop(*own, config)
        loop.model.velocity_limits[:] = [[-0.2], [0.2]]
        loop.reset(q, v)
        desired = frame_motion_at_rest(RigidTransform([0.0, 0.0, -0.5]) @ loop.pose(q))
        steps = [loop.step(q, v, np.zeros(6), desired).velocities for _ in range(300)]
        speeds.append(np.abs(steps).max())
    assert speeds[0] <= 0.2 + 1e-6
    assert speeds[1] > 0.3
    assert caplog.text.count("a joint's limit keeps the reference") == 1


def test_what_the_scheme_has_not_is_refused():
    own, _, _ = still()
    with pytest.raises(ConfigurationError, match="AdmittanceLoop, which returns joint positions"):
        ControlLoop(*own, config_of())
    with pytest.raises(ConfigurationError, match="Use ControlLoop, which returns torques"):
        AdmittanceLoop(*own, quick_config())
    config = config_of()
    config.redundancy.task = TaskConfig("manipulability")
    with pytest.raises(ConfigurationError, match="takes no task function"):
        make_impedance_controller(*own, config)
    config = config_of(8e-3)
    config.reference.gain = 200.0
    with pytest.raises(ConfigurationError, match=r"greatest gain is 1/period = 125 1/s"):
        check(config)
