"""The inner loop: inverse dynamics makes q̈ = α, and motion control makes the error decay."""

import logging

import numpy as np
import pytest
from arms import ArmPlant, make_arm_plant
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce, MultibodyPlant
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from rigs import arm_state_at

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.laws.motion_control.orientation_control import ORIENTATION_LAWS
from geoimp_drake.rotations import quaternion, so3
from geoimp_drake.systems.arm.arm_model import ArmModel
from geoimp_drake.systems.arm.inverse_dynamics_inner_loop import InverseDynamicsInnerLoop
from geoimp_drake.systems.arm.motion_controller import MotionController
from geoimp_drake.systems.arm.redundancy_resolver import RedundancyResolver
from geoimp_drake.systems.frame_motion import frame_motion_at_rest

WRENCH = np.array([2.0, -1.0, 3.0, 20.0, -30.0, 10.0])
VELOCITY = np.array([0.4, -0.5, 0.6, 0.3, -0.7, 0.5, 0.4])
ALPHA = np.array([1.0, -2.0, 1.5, 3.0, -2.5, 2.0, 1.0])
K_P, K_D = 2025.0, 65.0


class ContinuousArm:
    """An arm in continuous time under the inner loop, with a wrench at E that it knows."""

    def __init__(self, joints: int = 6, motion: MotionController | None = None, **options):
        self.builder = DiagramBuilder()
        plant = self.builder.AddSystem(MultibodyPlant(0.0))
        self.rig: ArmPlant = make_arm_plant(plant, joints, **options)
        self.model = ControlModel.of_arm(plant, self.rig.arm, self.rig.E)
        self.n = joints
        arm = self.builder.AddNamedSystem("arm", ArmModel(self.model))
        self.torque = self.builder.AddNamedSystem("torque", InverseDynamicsInnerLoop(self.model))
        self._wire(plant.get_state_output_port(self.rig.arm), arm.GetInputPort("state"))
        self._wire(arm.GetOutputPort("arm"), self.torque.GetInputPort("arm"))
        h = self.builder.AddSystem(ConstantVectorSource(WRENCH))
        self._wire(h.get_output_port(), self.torque.GetInputPort("wrench"))
        self._give_alpha(arm, motion)
        command = plant.get_actuation_input_port(self.rig.arm)
        self._wire(self.torque.GetOutputPort("actuation"), command)
        self.builder.ExportInput(plant.get_applied_spatial_force_input_port(), "push")
        self.simulator = Simulator(self.builder.Build())
        config = SimulatorConfig(
            integration_scheme="runge_kutta2", max_step_size=1e-3, use_error_control=False
        )
        ApplySimulatorConfig(config, self.simulator)
        self._push_back()

    def _wire(self, source, target) -> None:
        self.builder.Connect(source, target)

    def _give_alpha(self, arm: ArmModel, motion: MotionController | None) -> None:
        target = self.torque.GetInputPort("joint_acceleration")
        if motion is None:
            alpha = self.builder.AddSystem(ConstantVectorSource(ALPHA[: self.n]))
            self._wire(alpha.get_output_port(), target)
            return
        self.builder.AddSystem(motion)
        resolver = self.builder.AddSystem(RedundancyResolver(self.model))
        self._wire(arm.GetOutputPort("arm"), motion.GetInputPort("arm"))
        self._wire(arm.GetOutputPort("arm"), resolver.GetInputPort("arm"))
        self._wire(
            motion.GetOutputPort("task_acceleration"), resolver.GetInputPort("task_acceleration")
        )
        self._wire(resolver.GetOutputPort("joint_acceleration"), target)
        self.builder.ExportInput(motion.GetInputPort("reference_motion"), "reference")

    def _push_back(self) -> None:
        """The environment answers h with its opposite, at E's origin."""
        push = ExternallyAppliedSpatialForce()
        push.body_index = self.rig.E.body().index()
        push.p_BoBq_B = self.rig.E.GetFixedPoseInBodyFrame().translation()
        push.F_Bq_W = SpatialForce(-WRENCH[:3], -WRENCH[3:])
        self.fix("push", AbstractValue.Make([push]))

    def fix(self, port: str, value) -> None:
        self.simulator.get_system().GetInputPort(port).FixValue(
            self.simulator.get_mutable_context(), value
        )

    @property
    def context(self):
        return self.rig.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())

    def set_state(self, q: np.ndarray, v: np.ndarray) -> None:
        self.rig.plant.SetPositions(self.context, self.rig.arm, q)
        self.rig.plant.SetVelocities(self.context, self.rig.arm, v)

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        plant, arm = self.rig.plant, self.rig.arm
        return plant.GetPositions(self.context, arm), plant.GetVelocities(self.context, arm)

    def pose(self) -> RigidTransform:
        return self.rig.E.CalcPoseInWorld(self.context)

    def advance(self, time: float) -> None:
        self.simulator.AdvanceTo(time)


@pytest.mark.parametrize(
    "options",
    [
        {"joints": 6},
        {"joints": 7},
        {"joints": 6, "actuator_order": [4, 2, 6, 1, 3, 5]},
        {"joints": 6, "from_hand": True},
    ],
    ids=["six", "seven", "motors in another order", "declared from the hand"],
)
def test_joints_accelerate_as_told_with_a_wrench_at_the_hand(options: dict) -> None:
    arm = ContinuousArm(**options)
    n = arm.n
    v0, alpha = VELOCITY[:n], ALPHA[:n]
    # α is in the control model's order, from the base to the hand.
    order = arm.model.state_order[:n]
    arm.set_state(arm.rig.posture, v0)
    arm.advance(0.1)
    q, v = (part[order] for part in arm.state())
    np.testing.assert_allclose(v, v0[order] + 0.1 * alpha, atol=1e-6)
    expected = arm.rig.posture[order] + 0.1 * v0[order] + 0.005 * alpha
    np.testing.assert_allclose(q, expected, atol=1e-6)


def test_wrench_left_out_disturbs_the_joints() -> None:
    arm = ContinuousArm()
    arm.fix("push", AbstractValue.Make([_no_push(arm)]))
    arm.set_state(arm.rig.posture, VELOCITY[:6])
    arm.advance(0.05)
    v = arm.state()[1]
    assert np.abs(v - VELOCITY[:6] - 0.05 * ALPHA[:6]).max() > 0.05


def _no_push(arm: ContinuousArm) -> ExternallyAppliedSpatialForce:
    push = ExternallyAppliedSpatialForce()
    push.body_index = arm.rig.E.body().index()
    push.F_Bq_W = SpatialForce(np.zeros(6))
    return push


def damped_error(e0: float, t: float, K_P: float, K_D: float) -> float:
    """Returns the solution of ë + K_D ė + K_P e = 0 from e0 at rest."""
    roots = np.roots([1.0, K_D, K_P])
    a, b = roots
    return float(np.real(e0 * (b * np.exp(a * t) - a * np.exp(b * t)) / (b - a)))


@pytest.mark.parametrize("joints", [6, 7])
def test_tracking_error_obeys_its_differential_equation(joints: int) -> None:
    # Motors that do not saturate: the first torque is 600 Nm.
    arm = ContinuousArm(joints, MotionController(K_P, K_D, 4500.0, 65.0), effort=4000.0)
    start = arm.pose()
    offset, turn = np.array([0.02, -0.03, 0.01]), np.array([0.01, 0.02, -0.015])
    target = RigidTransform(start)
    target.set_translation(start.translation() + offset)
    motion = frame_motion_at_rest(target)
    motion[:4] = quaternion.product(quaternion.exp(turn), motion[:4])
    arm.fix("reference", motion)
    for time in (0.01, 0.03, 0.06):
        arm.advance(time)
        error = target.translation() - arm.pose().translation()
        np.testing.assert_allclose(error, offset * damped_error(1.0, time, K_P, K_D), atol=1e-5)
        rotation = so3.exp(turn) @ start.rotation().matrix() @ arm.pose().rotation().matrix().T
        # (2.14) is half the angle, so the stiffness of the angle is half of K_Po.
        expected = turn * damped_error(1.0, time, 2250.0, 65.0)
        np.testing.assert_allclose(so3.log(rotation), expected, atol=5e-6)


@pytest.mark.parametrize("law", ORIENTATION_LAWS)
def test_every_orientation_law_brings_the_hand_to_the_reference(law: str) -> None:
    arm = ContinuousArm(6, MotionController(orientation=law))
    target = arm.pose()
    motion = frame_motion_at_rest(target)
    motion[:4] = quaternion.product(quaternion.exp(np.array([0.1, -0.1, 0.05])), motion[:4])
    arm.fix("reference", motion)
    R_WD = quaternion.to_rotation(motion[:4])
    before = np.linalg.norm(so3.log(R_WD @ arm.pose().rotation().matrix().T))
    arm.advance(0.15)
    after = np.linalg.norm(so3.log(R_WD @ arm.pose().rotation().matrix().T))
    assert after < 0.05 * before


def test_motors_in_another_order_get_the_torques_of_their_joints() -> None:
    order = [4, 2, 6, 1, 3, 5]
    plain, shuffled = ContinuousArm(6), ContinuousArm(6, actuator_order=order)

    def torque(arm: ContinuousArm) -> np.ndarray:
        context = arm.torque.GetMyContextFromRoot(arm.simulator.get_context())
        return arm.torque.GetOutputPort("actuation").Eval(context)

    # Gear ratios belong to the joints in both.
    np.testing.assert_allclose(torque(shuffled), torque(plain)[np.array(order) - 1], rtol=1e-12)


def bare_inner_loop() -> tuple[InverseDynamicsInnerLoop, Simulator]:
    """Returns an inner loop of weak motors, fed by hand, and its simulator."""
    rig = make_arm_plant(effort=20.0, actuator_order=[6, 5, 4, 3, 2, 1])
    model = ControlModel.of_arm(rig.plant, rig.arm, rig.E)
    loop = InverseDynamicsInnerLoop(model)
    loop.set_name("loop")
    simulator = Simulator(loop)
    context = simulator.get_mutable_context()
    arm = arm_state_at(model, rig.posture, np.zeros(6))
    loop.GetInputPort("arm").FixValue(context, AbstractValue.Make(arm))
    loop.GetInputPort("wrench").FixValue(context, np.zeros(6))
    loop.GetInputPort("joint_acceleration").FixValue(context, np.zeros(6))
    return loop, simulator


def test_saturation_is_said_once_for_each_joint_with_both_numbers(caplog) -> None:
    # Where a law is not compiled yet, that is said as information.
    caplog.set_level(logging.WARNING, logger="drake")
    loop, simulator = bare_inner_loop()
    context = simulator.get_mutable_context()
    torque = loop.GetOutputPort("actuation").Eval(context)[::-1].copy()
    over = [f"joint{k + 1}" for k in range(6) if abs(torque[k]) > 20.0]
    assert over == ["joint3"]
    simulator.AdvanceTo(0.01)
    assert len(caplog.records) == 1
    for text in ("loop", "'joint3'", f"{torque[2]:.1f}", "±20"):
        assert text in caplog.text
    peak = loop.GetOutputPort("peak_effort").Eval(context)[::-1]
    np.testing.assert_allclose(peak, np.abs(torque) / 20.0)


@pytest.mark.parametrize("port", ["wrench", "joint_acceleration"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_value_that_is_not_finite_is_refused_by_port_and_number(port: str, bad: float) -> None:
    loop, simulator = bare_inner_loop()
    value = np.zeros(6)
    value[2] = bad
    loop.GetInputPort(port).FixValue(simulator.get_mutable_context(), value)
    with pytest.raises(SignalError, match=rf"loop:{port}.*2: {bad}"):
        simulator.AdvanceTo(0.01)


def test_a_reference_that_cannot_be_is_refused_by_port_and_number() -> None:
    motion = MotionController()
    motion.set_name("motion")
    context = motion.CreateDefaultContext()
    rig = make_arm_plant()
    model = ControlModel.of_arm(rig.plant, rig.arm, rig.E)
    arm = arm_state_at(model, rig.posture, np.zeros(6))
    motion.GetInputPort("arm").FixValue(context, AbstractValue.Make(arm))
    good = frame_motion_at_rest(RigidTransform())
    for index, bad, message in (
        (8, np.nan, r"motion:reference_motion.*8: nan"),
        (16, -np.inf, r"motion:reference_motion.*16: -inf"),
        (0, 1.001, r"motion:reference_motion.*norm is 1\.001"),
    ):
        value = good.copy()
        value[index] = bad
        motion.GetInputPort("reference_motion").FixValue(context, value)
        with pytest.raises(SignalError, match=message):
            motion.get_output_port().Eval(context)


@pytest.mark.parametrize("name", ["K_Pp", "K_Dp", "K_Po", "K_Do"])
@pytest.mark.parametrize("bad", [0.0, -65.0, np.nan, np.inf])
def test_a_motion_gain_that_cannot_be_used_is_refused_by_name(name: str, bad: float) -> None:
    with pytest.raises(ConfigurationError, match=rf"{name} is {bad:g}"):
        MotionController(**{name: bad})


def test_an_unknown_orientation_law_is_refused_with_the_nearest() -> None:
    with pytest.raises(ConfigurationError, match=r"'quaternions'.*quaternion, .*angle-axis-sin"):
        MotionController(orientation="quaternions")


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_joint_state_that_is_not_finite_is_refused_by_the_arm_model(bad: float) -> None:
    rig = make_arm_plant()
    arm = ArmModel(ControlModel.of_arm(rig.plant, rig.arm, rig.E))
    arm.set_name("arm")
    context = arm.CreateDefaultContext()
    state = np.zeros(12)
    state[7] = bad
    arm.GetInputPort("state").FixValue(context, state)
    for port in ("arm", "motion_E"):
        with pytest.raises(SignalError, match=rf"arm:state.*7: {bad}"):
            arm.GetOutputPort(port).Eval(context)


def test_a_task_acceleration_that_is_not_finite_is_refused() -> None:
    rig = make_arm_plant()
    model = ControlModel.of_arm(rig.plant, rig.arm, rig.E)
    resolver = RedundancyResolver(model)
    resolver.set_name("resolver")
    context = resolver.CreateDefaultContext()
    arm = arm_state_at(model, rig.posture, np.zeros(6))
    resolver.GetInputPort("arm").FixValue(context, AbstractValue.Make(arm))
    resolver.GetInputPort("task_acceleration").FixValue(context, [0, 0, 0, 0, np.nan, 0])
    with pytest.raises(SignalError, match=r"resolver:task_acceleration.*4: nan"):
        resolver.GetOutputPort("joint_acceleration").Eval(context)
