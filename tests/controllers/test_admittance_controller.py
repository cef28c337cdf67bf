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

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.controllers.admittance_controller import AdmittanceLoop
from geoimp_drake.controllers.config import FORMS, ImpedanceControllerConfig
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.controllers.wrist_sensor import add_wrist_sensor
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.inverse_kinematics import ReferenceConfig
from geoimp_drake.systems.arm.industrial_controller import (
    IndustrialControllerConfig,
    make_industrial_controller,
)
from geoimp_drake.systems.frame_motion import frame_motion_at_rest
from geoimp_drake.task_functions.config import TaskConfig
from geoimp_drake.validation import check

PUSH, NONE = np.array([15.0, 0.0, 0.0]), np.zeros(6)


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


class Streamed:
    """What a loop streams while D moves: extremes over the ticks, and the loop at the end."""

    def __init__(self, joints, duration, way, period=4e-3, ticks=lambda: 1.0, wrench=NONE):
        own, q, v = still(joints)
        self.loop = loop = AdmittanceLoop(*own, config_of(period))
        dynamics = ChainDynamics(loop.model)
        loop.reset(q, v)
        X, t, x = loop.pose(q), 0.0, np.concatenate((q, v))
        self.error = self.speed = self.effort = 0.0
        self.room, self.acted = np.inf, np.zeros(4, dtype=bool)
        while t < duration:
            elapsed = ticks() * period
            t += elapsed
            self.desired = frame_motion_at_rest(RigidTransform(way(t)) @ X)
            found = loop.step(q, v, wrench, self.desired, elapsed)
            arm = dynamics.evaluate(None, x)
            alpha = (found.velocities - arm.v) / min(elapsed, period)
            torque = np.abs(arm.B @ alpha + arm.Cv + arm.Fv + arm.g)
            if elapsed == period:
                self.effort = max(self.effort, (torque / loop.model.effort_limits).max())
            moved = np.abs(found.positions - x[:joints]) / elapsed
            x = np.concatenate(found)
            limits = loop.model.position_limits, loop.model.velocity_limits[1]
            self.speed = max(self.speed, (moved / limits[1]).max())
            room = np.minimum(found.positions - limits[0][0], limits[0][1] - found.positions)
            self.room = min(self.room, room.min())
            self.acted |= loop.output("limited")[:4] > 0
            self.error = max(self.error, np.linalg.norm(loop.output("reference_error")))
        self.posture = np.abs(x[:joints] - q).max()
        self.left = np.linalg.norm(loop.output("compliant_motion")[4:7] - self.desired[4:7])

    def stays_inside(self) -> bool:
        return self.room >= 0.02 - 1e-6 and self.speed <= 0.95 + 1e-9 and self.effort <= 1.0


def swing(*way):
    """Returns how D goes there in 6 s, and back until 12 s."""
    return lambda t: np.array(way) * (np.sin(np.pi * t / 12.0) ** 2 if t < 12.0 else 0.0)


@pytest.mark.parametrize(
    ("joints", "way"), [(6, (1.0, 0, 0.5)), (6, (-1.0, 0, 0)), (7, (1.0, 0, 0.5)), (7, (1.0, 0, 0))]
)
def test_beyond_the_workspace_C_is_held_back_with_the_reference_and_both_come_back(joints, way):
    """Not held back, C is up to 0.8 m from the reference, which a singularity then keeps."""
    run = Streamed(joints, 16.0, swing(*way))
    assert run.acted[3]
    assert run.error < 0.03  # 10, 9, 27 and 15 mm
    assert run.stays_inside()
    assert run.left < 1e-9
    assert np.linalg.norm(run.loop.output("reference_error")) < 1e-7


def test_a_joint_stop_in_the_way_keeps_C_with_the_reference_and_is_said(caplog):
    """Behind a singularity the arm comes back in another posture, as with scheme inner-loop."""
    run = Streamed(6, 16.0, swing(0, 1.0, 0))
    assert run.posture > 1.0
    assert run.loop.output("limited")[0] == 1
    assert run.error < 0.03
    assert run.stays_inside()
    assert caplog.text.count("a joint comes near an end of its range") == 1


def lost_ticks(seed=1):
    """Returns ticks of half to one and a half periods, some of them of up to thirty."""
    rng = np.random.default_rng(seed)
    return lambda: rng.uniform(0.5, 1.5) if rng.random() > 0.05 else rng.uniform(2.0, 30.0)


@pytest.mark.parametrize("joints", [6, 7])
def test_D_that_jumps_out_of_reach_is_followed_within_the_limits_whatever_the_ticks(joints):
    def way(t):
        return np.array([3.0 if t < 3.0 else 0.0, 0.0, 0.0])

    for ticks, most in ((lambda: 1.0, 0.12), (lost_ticks(), 3.0)):
        run = Streamed(joints, 12.0, way, ticks=ticks)
        assert run.error < most  # from 3 m
        assert run.stays_inside()
        # With six joints a stop of another posture keeps C away, see above.
        assert run.left < 1e-3 or run.loop.output("limited")[0]


def test_late_and_lost_ticks_leave_the_reference_where_others_do():
    push = np.array([0.0, 0.0, 0.0, *PUSH])
    ends = []
    for ticks in (lambda: 1.0, lost_ticks()):
        run = Streamed(7, 3.0, lambda t: np.array([0.1 * t, 0.0, 0.0]), ticks=ticks, wrench=push)
        ends.append(run.loop.output("compliant_motion")[4:7] - run.desired[4:7])
        assert not run.acted.any()
        assert np.linalg.norm(run.loop.output("reference_error")) < 1e-5
    np.testing.assert_allclose(*ends, atol=2e-3)  # of 38 mm behind D, which goes on in steps


def test_limits_cannot_be_left_out():
    config = config_of()
    config.limits = None
    with pytest.raises(ConfigurationError, match="limits is null; with scheme: admittance"):
        check(config)


def test_what_the_scheme_has_not_is_refused():
    own, _, _ = still()
    with pytest.raises(ConfigurationError, match="AdmittanceLoop, which returns joint positions"):
        ControlLoop(*own, config_of())
    with pytest.raises(ConfigurationError, match="Use ControlLoop, which returns torques"):
        AdmittanceLoop(*own, quick_config())
    config = config_of()
    task = TaskConfig("manipulability")
    with pytest.raises(ConfigurationError, match="takes no task function"):
        make_impedance_controller(*own, config, task.make(ControlModel.of_arm(*own)))
    config.redundancy.task = task
    with pytest.raises(ConfigurationError, match=r"redundancy\.task is given"):
        make_impedance_controller(*own, config)
    config = config_of(8e-3)
    config.reference = ReferenceConfig(gain=200.0)
    with pytest.raises(ConfigurationError, match=r"greatest gain is 1/period = 125 1/s"):
        check(config)
