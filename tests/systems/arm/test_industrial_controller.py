"""The industrial control unit: joint servos that hold, follow, wind up no further, saturate."""

import dataclasses
import logging

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant, MultibodyPlantConfig
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.trajectories import PiecewisePolynomial

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.controllers.wrist_sensor import add_wrist_sensor
from geoimp_drake.diagrams.scene.cell import END_EFFECTOR, SEVEN, add_cell
from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.models.robot_data import dh_to_joint
from geoimp_drake.motion_program.plan import MotionPlan, PlanConfig, plan
from geoimp_drake.motion_program.program import (
    JointMove,
    MotionProgram,
    SpeedOverride,
    ToolMove,
)
from geoimp_drake.systems.arm.industrial_controller import (
    IndustrialController,
    IndustrialControllerConfig,
    make_industrial_controller,
)
from geoimp_drake.systems.frame_motion import frame_motion_at_rest
from geoimp_drake.systems.hand_over import HandOver
from geoimp_drake.systems.sources.external_wrench import ExternalWrench, WrenchRamp
from geoimp_drake.validation import check

START = np.append(-0.2, dh_to_joint(np.radians([8.83, 75.05, -47.63, 9.93, 62.93, 175.45])))
NEAR = START + np.array([0.1, 0.1, -0.1, 0.1, 0.2, 0.1, -0.2])
REST = PiecewisePolynomial(START)


class Cell:
    """The track arm under its control unit."""

    def __init__(self, program=None, config=None, plan_config=None, sampled: bool = True):
        builder = DiagramBuilder()
        self.plant, _ = AddMultibodyPlant(
            MultibodyPlantConfig(time_step=1e-3, use_sampled_output_ports=sampled), builder
        )
        add_cell(self.plant, "track_arm")
        self.plant.Finalize()
        self.arm = self.plant.GetModelInstanceByName(SEVEN)
        tool = self.plant.GetModelInstanceByName(f"{SEVEN}_tool")
        self.T = self.plant.GetFrameByName(END_EFFECTOR, tool)
        self.plant.SetDefaultPositions(self.arm, START)
        self.motion: MotionPlan | None = None
        if program is not None:
            self.motion = plan(self.plant, self.arm, self.T, program, START, plan_config)
        self.unit = builder.AddSystem(
            make_industrial_controller(
                self.plant,
                self.arm,
                self.T,
                self.motion.trajectory if self.motion else REST,
                config,
            )
        )
        builder.Connect(self.plant.get_state_output_port(self.arm), self.unit.get_input_port())
        builder.Connect(
            self.unit.GetOutputPort("actuation"), self.plant.get_actuation_input_port(self.arm)
        )
        self.simulator = Simulator(builder.Build())
        self._kinematics = self.plant.CreateDefaultContext()

    def read(self, port: str) -> np.ndarray:
        context = self.unit.GetMyContextFromRoot(self.simulator.get_context())
        return self.unit.GetOutputPort(port).Eval(context).copy()

    def pose(self, q: np.ndarray) -> RigidTransform:
        self.plant.SetPositions(self._kinematics, self.arm, q)
        return self.T.CalcPoseInWorld(self._kinematics)

    def tip_error(self, time: float) -> float:
        """Runs up to a time; returns how far the tool is from its set-point [m]."""
        self.simulator.AdvanceTo(time)
        context = self.plant.GetMyContextFromRoot(self.simulator.get_context())
        wanted, real = (
            self.pose(q).translation()
            for q in (self.read("set_point")[:7], self.plant.GetPositions(context, self.arm))
        )
        return float(np.linalg.norm(wanted - real))


@pytest.mark.parametrize("sampled", [True, False])
def test_arm_is_held_from_the_start_with_the_preload_and_sags_without(sampled):
    times = np.arange(0.0, 0.4, 0.01)
    held = Cell(sampled=sampled)
    assert max(held.tip_error(t) for t in times) < 2e-4
    sagging = Cell(sampled=sampled, config=IndustrialControllerConfig(preload=False))
    assert max(sagging.tip_error(t) for t in times) > 5e-3


def test_integral_part_takes_the_weight_in_two_seconds():
    cell = Cell(config=IndustrialControllerConfig(preload=False))
    assert cell.tip_error(2.0) < 2e-4


def test_program_is_followed_with_the_error_of_a_control_unit():
    """Fast moves lag by some millimetres; at 3 % the tool keeps to its line."""
    program = MotionProgram(
        [JointMove(NEAR), ToolMove([0, 0, 0.1]), SpeedOverride(3), ToolMove([0, 0, 0.012])]
    )
    cell = Cell(program)
    joints, fast, slow = cell.motion.segments
    assert 1e-3 < max(cell.tip_error(t) for t in np.arange(0.0, joints.end, 0.02)) < 0.025
    assert max(cell.tip_error(t) for t in np.arange(joints.end, fast.end, 0.02)) < 0.02
    slowly = np.arange(slow.begin + 0.5, slow.end, 0.05)
    assert max(cell.tip_error(t) for t in slowly) < 2e-4
    assert cell.tip_error(slow.end + 0.3) < 1e-4
    assert (cell.read("peak_effort") < 1.0).all()


def test_set_point_is_the_trajectory_and_rests_beyond_its_ends():
    line = PiecewisePolynomial.FirstOrderHold([1.0, 2.0], np.column_stack((START, NEAR)))
    unit, context = lone_unit(line)
    for time, q, v in (
        (0.5, START, 0 * START),
        (1.25, START + 0.25 * (NEAR - START), NEAR - START),
        (2.5, NEAR, 0 * START),
    ):
        context.SetTime(time)
        np.testing.assert_allclose(
            unit.GetOutputPort("set_point").Eval(context), np.append(q, v), atol=1e-12
        )


def arm_model() -> ControlModel:
    plant = MultibodyPlant(1e-3)
    add_cell(plant, "track_arm")
    plant.Finalize()
    tool = plant.GetModelInstanceByName(f"{SEVEN}_tool")
    return ControlModel.of_arm(
        plant, plant.GetModelInstanceByName(SEVEN), plant.GetFrameByName(END_EFFECTOR, tool)
    )


MODEL = arm_model()
KP = np.array([4e4, 3e4, 3e4, 1e4, 500.0, 400.0, 200.0])


def lone_unit(trajectory=REST, config=None, hold=None, model=MODEL):
    hold = np.zeros(7) if hold is None else hold
    unit = IndustrialController(model, trajectory, KP, hold, config)
    return unit, unit.CreateDefaultContext()


def advanced(unit, state: np.ndarray, samples: int) -> Simulator:
    """Lets the servos sample a state that stays, so many times."""
    simulator = Simulator(unit)
    unit.get_input_port().FixValue(simulator.get_mutable_context(), state)
    simulator.AdvanceTo((samples - 1) * 1e-3)
    simulator.AdvancePendingEvents()
    return simulator


def output(unit, simulator, name: str) -> np.ndarray:
    return unit.GetOutputPort(name).Eval(simulator.get_context()).copy()


def test_torque_of_a_sample_is_that_of_the_gains():
    config = IndustrialControllerConfig(bandwidth=20.0, damping=0.7, integral_rate=2.0)
    e, de, hold = 1e-3 * np.arange(1.0, 8.0), 1e-3 * np.arange(-3.0, 4.0), 0.1 * np.arange(7.0)
    unit, context = lone_unit(config=config, hold=hold)
    np.testing.assert_array_equal(unit.GetOutputPort("actuation").Eval(context), hold)
    state = np.append(START - e, -de)
    kd = 2 * 0.7 / 20.0 * KP
    for samples in (1, 5):
        torque = output(unit, advanced(unit, state, samples), "actuation")
        integral = hold + (samples - 1) * 2.0 * KP * e * 1e-3
        np.testing.assert_allclose(torque, KP * e + kd * de + integral, rtol=1e-9)


def test_joints_and_actuators_in_another_order_get_what_is_theirs():
    order = np.array([3, 0, 1, 2, 6, 5, 4])
    other = dataclasses.replace(
        MODEL, state_order=np.append(order, 7 + order), actuation_order=np.argsort(order)[::-1]
    )
    e = 1e-3 * np.arange(1.0, 8.0)
    unit, _ = lone_unit(model=other)
    state = np.zeros(14)
    state[other.state_order] = np.append(START - e, np.zeros(7))
    simulator = advanced(unit, state, 1)
    torque = output(unit, simulator, "actuation")
    np.testing.assert_allclose(torque, (KP * e)[other.actuation_order], rtol=1e-9)
    np.testing.assert_allclose(
        (output(unit, simulator, "set_point") - state)[other.state_order][:7], e, atol=1e-12
    )


def test_integral_part_stops_at_its_limit():
    config = IndustrialControllerConfig(integral_limit=0.25, integral_rate=50.0)
    unit, _ = lone_unit(config=config)
    e = 0.05 * MODEL.effort_limits / KP
    late, later = (
        output(unit, advanced(unit, np.append(START + e, np.zeros(7)), k), "actuation")
        for k in (400, 500)
    )
    np.testing.assert_array_equal(late, later)
    np.testing.assert_allclose(later, -0.30 * MODEL.effort_limits, rtol=1e-9)


def test_saturation_is_the_limit_and_is_told_once(caplog):
    unit, _ = lone_unit(config=IndustrialControllerConfig(integral_rate=0.0))
    unit.set_name("unit")
    e = np.array([0.1, 0.1, 0.1, 2.0, 0.1, 0.1, -2.0]) * MODEL.effort_limits / KP
    with caplog.at_level(logging.WARNING, logger="drake"):
        simulator = advanced(unit, np.append(START - e, np.zeros(7)), 20)
    share = np.array([0.1, 0.1, 0.1, 1.0, 0.1, 0.1, -1.0])
    np.testing.assert_allclose(output(unit, simulator, "actuation"), share * MODEL.effort_limits)
    peak = output(unit, simulator, "peak_effort")
    np.testing.assert_allclose(peak, [0.1, 0.1, 0.1, 2.0, 0.1, 0.1, 2.0])
    told = [record.getMessage() for record in caplog.records]
    assert len(told) == 2
    assert "joint 'elbow' saturates at t = 0.000 s" in told[0]


def test_gains_and_preload_come_from_the_start_posture():
    cell = Cell()
    context = cell.plant.CreateDefaultContext()
    cell.plant.SetPositions(context, cell.arm, START)
    weight = cell.plant.CalcGravityGeneralizedForces(context)
    hold = -cell.plant.GetVelocitiesFromArray(cell.arm, weight)
    np.testing.assert_allclose(cell.read("actuation"), hold, atol=1e-9)
    B = cell.plant.CalcMassMatrix(context)
    for joint in map(cell.plant.get_joint, cell.plant.GetJointIndices(cell.arm)):
        for k, friction in enumerate(joint.default_damping_vector(), joint.velocity_start()):
            B[k, k] += cell.plant.time_step() * friction  # as the plant's steps have it
    diag = cell.plant.GetVelocitiesFromArray(cell.arm, np.diag(B))
    np.testing.assert_allclose(cell.unit._kp, 900.0 * diag, rtol=1e-9)


def test_given_gains_are_taken():
    assert (Cell(config=IndustrialControllerConfig(kp=KP)).unit._kp == KP).all()


def test_two_simulations_of_one_unit_are_independent():
    cell = Cell(MotionProgram([ToolMove([0, 0, 0.05])]))
    other = Simulator(cell.simulator.get_system(), cell.simulator.get_context().Clone())
    cell.simulator.AdvanceTo(0.2)
    before = cell.read("actuation")
    other.AdvanceTo(0.1)
    np.testing.assert_array_equal(cell.read("actuation"), before)
    other.AdvanceTo(0.2)
    theirs = cell.unit.GetMyContextFromRoot(other.get_context())
    np.testing.assert_array_equal(cell.unit.GetOutputPort("actuation").Eval(theirs), before)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("bandwidth", 0.0),
        ("damping", -0.1),
        ("integral_rate", -1.0),
        ("integral_limit", np.nan),
        ("period", 0.0),
        ("kp", np.zeros(7)),
        ("kp", [1.0, np.inf]),
    ],
)
def test_configuration_that_cannot_be_used_is_named(field, value):
    with pytest.raises(ConfigurationError, match=rf"servo\.{field}"):
        check(IndustrialControllerConfig(**{field: value}), "servo")


def test_what_does_not_fit_the_arm_is_refused():
    with pytest.raises(ConfigurationError, match=r"6 rows .* 7 joints"):
        lone_unit(PiecewisePolynomial(START[:6]))
    with pytest.raises(ConfigurationError, match=r"integral part's limit: shoulder 1500"):
        lone_unit(hold=np.array([0, 0, 1500.0, 0, 0, 0, 0]))
    with pytest.raises(ConfigurationError, match="holding torque"):
        lone_unit(hold=np.zeros(6))
    with pytest.raises(ConfigurationError, match=r"servo\.kp"):
        Cell(config=IndustrialControllerConfig(kp=np.ones(6)))


def test_reading_that_is_not_a_number_is_refused():
    unit, _ = lone_unit()
    with pytest.raises(SignalError, match="estimated_state"):
        advanced(unit, np.full(14, np.nan), 1)


def test_joint_speeds_of_the_plan_are_what_the_servos_are_asked_for():
    config = PlanConfig(joint_speeds=np.full(7, 0.2), joint_move_speed=1.0)
    cell = Cell(MotionProgram([JointMove(NEAR)]), plan_config=config)
    fastest = 0.0
    for t in np.arange(0.0, cell.motion.trajectory.end_time(), 0.02):
        cell.simulator.AdvanceTo(t)
        fastest = max(fastest, np.abs(cell.read("set_point")[7:]).max())
    assert fastest == pytest.approx(0.2, rel=1e-6)


class HandBack:
    """The track arm under an impedance, handed over to servos whose trajectory is elsewhere."""

    def __init__(self, push: float):
        builder = DiagramBuilder()
        plant, _ = AddMultibodyPlant(MultibodyPlantConfig(time_step=1e-3), builder)
        add_cell(plant, "track_arm")
        self.arm = plant.GetModelInstanceByName(SEVEN)
        sensor_instance, tool = (
            plant.GetModelInstanceByName(f"{SEVEN}_{what}") for what in ("sensor", "tool")
        )
        self.T = plant.GetFrameByName(END_EFFECTOR, tool)
        source = builder.AddSystem(
            ExternalWrench(self.T, WrenchRamp(force=[0.0, 0.0, push], duration=0.3, blend=0.1))
        )
        plant.Finalize()
        plant.SetDefaultPositions(self.arm, START)
        self.plant, n = plant, 7
        X_WE = self.T.CalcPoseInWorld(plant.CreateDefaultContext())
        D = builder.AddSystem(ConstantVectorSource(frame_motion_at_rest(X_WE)))
        config = ImpedanceControllerConfig(form="compiled")
        config.impedance.translation.damping = np.array(300.0)  # so that it rests after 5 s
        soft = builder.AddSystem(make_impedance_controller(plant, self.arm, self.T, config))
        joint = plant.GetJointByName("wrist_sensor", sensor_instance)
        wrench = add_wrist_sensor(builder, plant, joint, self.T)
        far = PiecewisePolynomial(NEAR)
        self.unit = builder.AddSystem(make_industrial_controller(plant, self.arm, self.T, far))
        self.over = builder.AddSystem(HandOver(n))
        self.selected = builder.AddSystem(ConstantVectorSource([0.0]))
        state = plant.get_state_output_port(self.arm)
        for output, to in (
            (D.get_output_port(), soft.GetInputPort("desired_motion")),
            (state, soft.GetInputPort("estimated_state")),
            (wrench.GetOutputPort("wrench"), soft.GetInputPort("wrench")),
            (state, self.unit.get_input_port()),
            (soft.GetOutputPort("actuation"), self.over.GetInputPort("torque_1")),
            (self.unit.GetOutputPort("actuation"), self.over.GetInputPort("torque_2")),
            (self.selected.get_output_port(), self.over.GetInputPort("selected")),
            (self.over.get_output_port(), plant.get_actuation_input_port(self.arm)),
            (source.get_output_port(), plant.get_applied_spatial_force_input_port()),
        ):
            builder.Connect(output, to)
        self.simulator = Simulator(builder.Build())

    def context(self, system):
        return system.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())

    def torque(self) -> np.ndarray:
        return self.over.get_output_port().Eval(self.context(self.over)).copy()

    def place(self) -> np.ndarray:
        return self.T.CalcPoseInWorld(self.context(self.plant)).translation()

    def jump_and_way(self, begin: float, *, preset: bool = True) -> tuple[float, float]:
        """Hands over; returns how far a torque [Nm] and E [m] get from where they were."""
        self.simulator.AdvanceTo(begin)
        before, place = self.torque(), self.place()
        if preset:
            self.unit.preset(self.context(self.unit), before)
        source = self.selected.get_mutable_source_value(self.context(self.selected))
        source.SetFromVector([1.0])
        jump = way = 0.0
        for k in range(1, 601):
            self.simulator.AdvanceTo(begin + 1e-3 * k)
            jump = max(jump, np.abs(self.torque() - before).max())
            way = max(way, np.linalg.norm(self.place() - place))
        return jump, way


@pytest.mark.parametrize("push", [0.0, 15.0])
def test_servos_that_are_preset_take_over_without_a_jump(push):
    """At rest, and with the hand 21 mm from D under a push; without the preset E is torn away."""
    cell = HandBack(push)
    jump, way = cell.jump_and_way(5.0)
    assert jump <= 0.01
    assert way <= 1e-6


def test_servos_that_are_not_preset_jump():
    jump, way = HandBack(0.0).jump_and_way(0.1, preset=False)
    assert jump > 10.0
    assert way > 1e-2


def test_preset_holds_while_the_arm_moves_and_its_orders_are_kept():
    """τ is that given at the next sample, whatever the speed: D of the servo is in z."""
    order = np.array([3, 0, 1, 2, 6, 5, 4])
    other = dataclasses.replace(
        MODEL, state_order=np.append(order, 7 + order), actuation_order=np.argsort(order)[::-1]
    )
    unit, _ = lone_unit(model=other)
    simulator, context = Simulator(unit), None
    context = simulator.get_mutable_context()
    unit.get_input_port().FixValue(context, np.append(NEAR, 0.1 * np.arange(7.0)))
    acting = np.arange(1.0, 8.0)
    unit.preset(context, acting)
    np.testing.assert_array_equal(output(unit, simulator, "actuation"), acting)
    simulator.AdvancePendingEvents()
    np.testing.assert_allclose(output(unit, simulator, "actuation"), acting, rtol=0, atol=1e-9)
    np.testing.assert_allclose(output(unit, simulator, "set_point")[:7], NEAR, rtol=0, atol=1e-12)


def test_preset_that_cannot_be_is_refused():
    unit, context = lone_unit()
    unit.get_input_port().FixValue(context, np.append(START, np.zeros(7)))
    with pytest.raises(ConfigurationError, match=r"integral part's limit: shoulder 1500"):
        unit.preset(context, np.array([0, 0, 1500.0, 0, 0, 0, 0]))
    with pytest.raises(ConfigurationError, match="preset torque"):
        unit.preset(context, np.zeros(6))


def test_a_streamed_reference_is_in_the_order_of_the_state():
    order = np.array([2, 0, 1, 6, 5, 4, 3])
    model = dataclasses.replace(MODEL, state_order=np.concatenate((order, 7 + order)))
    unit, context = lone_unit(None, model=model)
    reference = np.arange(14.0)
    unit.GetInputPort("joint_reference").FixValue(context, reference)
    np.testing.assert_array_equal(unit.GetOutputPort("set_point").Eval(context), reference)


def test_a_streamed_reference_that_is_not_finite_is_refused():
    unit, context = lone_unit(None)
    unit.GetInputPort("joint_reference").FixValue(context, np.full(14, np.nan))
    with pytest.raises(SignalError, match="joint_reference"):
        unit.GetOutputPort("set_point").Eval(context)


def test_servos_that_are_preset_take_streamed_references_over_without_a_jump():
    """What is streamed counts from where the arm is; its steps are followed as they come."""
    unit, _ = lone_unit(None)
    simulator = Simulator(unit)
    context = simulator.get_mutable_context()
    reading = np.append(START, 0.1 * np.arange(7.0) + 1e-3)
    streamed = np.append(NEAR, 0.1 * np.arange(7.0))
    reference = unit.GetInputPort("joint_reference").FixValue(context, streamed)
    unit.GetInputPort("estimated_state").FixValue(context, reading)
    acting = np.arange(1.0, 8.0)
    unit.preset(context, acting)
    np.testing.assert_array_equal(output(unit, simulator, "actuation"), acting)
    set_point = unit.GetOutputPort("set_point")
    np.testing.assert_allclose(set_point.Eval(context)[:7], START, atol=1e-12)
    simulator.AdvanceTo(1e-3)
    np.testing.assert_allclose(output(unit, simulator, "actuation"), acting, rtol=1e-9)
    moved = np.append(NEAR + 0.01, streamed[7:])
    reference.GetMutableData().get_mutable_value().SetFromVector(moved)
    np.testing.assert_allclose(set_point.Eval(context)[:7], START + 0.01, atol=1e-12)
