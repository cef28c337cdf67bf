"""Every block has derivatives by AutoDiff, which are those of differences, or says why not."""

import numpy as np
import pytest
from continuous_loop import POSTURES, ContinuousLoop
from impedance_rig import K_O, K_P, make_impedance
from law_numerics import every_family
from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, InitializeAutoDiff
from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder, PortDataType, System
from redundant_arms import track_arm
from scipy.linalg import block_diag
from test_ports_blocks import CASES, six_joint_model

from geoimp_drake.analysis.linearization import linearize
from geoimp_drake.errors import ConversionError
from geoimp_drake.laws.motion_control.orientation_control import ORIENTATION_LAWS
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.arm.arm_model import ArmModel
from geoimp_drake.systems.arm.inverse_dynamics_inner_loop import InverseDynamicsInnerLoop
from geoimp_drake.systems.arm.motion_controller import MotionController
from geoimp_drake.systems.arm.redundancy_resolver import RedundancyResolver
from geoimp_drake.systems.cooperation.internal_impedance import InternalImpedance
from geoimp_drake.systems.direct_impedance import DirectImpedance
from geoimp_drake.systems.impedance_integrator import ImpedanceIntegrator
from geoimp_drake.systems.part_system import Block
from geoimp_drake.systems.sources.desired_motion import DesiredMotion, MotionSegment
from geoimp_drake.systems.sources.external_wrench import ExternalWrench
from geoimp_drake.systems.sources.smooth_target import SmoothTarget

WITH_DERIVATIVES = {
    ArmModel,
    DesiredMotion,
    DirectImpedance,
    ExternalWrench,
    ImpedanceIntegrator,
    InternalImpedance,
    InverseDynamicsInnerLoop,
    MotionController,
    RedundancyResolver,
    SmoothTarget,
}


# Of E in the posture of six joints, so that every orientation law is in its domain.
ATTITUDE = quaternion.from_rotation(ContinuousLoop(6).X_WE.rotation().matrix())


class Fed:
    """A block with an arm where it takes one, and values at its ports that are vectors."""

    def __init__(self, block: System, model=None, without: tuple[str, ...] = ()):
        builder, rng = DiagramBuilder(), np.random.default_rng(0)
        self.block = builder.AddNamedSystem("block", block)
        values, ways = [], []
        for k in range(block.num_input_ports()):
            port = block.get_input_port(k)
            if port.get_name() == "arm":
                arm = builder.AddSystem(ArmModel(model or six_joint_model()))
                builder.Connect(arm.GetOutputPort("arm"), port)
                builder.ExportInput(arm.GetInputPort("state"))
                n = arm.model.num_joints
                values.append(np.concatenate((POSTURES[n], 0.3 * rng.standard_normal(n))))
                ways.append(rng.standard_normal(2 * n))
            elif (
                port.get_data_type() == PortDataType.kVectorValued
                and port.get_name() not in without
            ):
                builder.ExportInput(port)
                for part, made in zip((values, ways), signal(port, rng), strict=True):
                    part.append(made)
        for k in range(block.num_output_ports()):
            builder.ExportOutput(block.get_output_port(k))
        self.diagram = builder.Build()
        x = self.diagram.CreateDefaultContext().get_continuous_state_vector().CopyToVector()
        if len(x):
            x, way = (part[: len(x)] for part in motion(rng))
            values, ways = [*values, x], [*ways, way]
        self.z, self.way = np.concatenate((*values, [])), np.concatenate((*ways, []))

    def evaluate(self, diagram: System, z: np.ndarray) -> np.ndarray:
        """Returns all outputs that are vectors, and the state's derivative."""
        context, at = diagram.CreateDefaultContext(), 0
        for k in range(diagram.num_input_ports()):
            port = diagram.get_input_port(k)
            port.FixValue(context, z[at : at + port.size()])
            at += port.size()
        if at < len(z):
            context.SetContinuousState(z[at:])
        ports = map(diagram.get_output_port, range(diagram.num_output_ports()))
        vectors = [p for p in ports if p.get_data_type() == PortDataType.kVectorValued]
        found = [port.Eval(context) for port in vectors]
        return np.concatenate((*found, diagram.EvalTimeDerivatives(context).CopyToVector()))

    def check(self) -> None:
        """Compares values, and derivatives along a way, with those of floats."""
        found = self.evaluate(self.diagram.ToAutoDiffXd(), InitializeAutoDiff(self.z).ravel())
        values = np.array([float(value.value()) for value in found])
        expected = self.evaluate(self.diagram, self.z)
        np.testing.assert_allclose(values, expected, atol=1e-9 * np.abs(expected).max(initial=1.0))
        gradient = ExtractGradient(found.reshape(-1, 1))
        ends = [self.evaluate(self.diagram, self.z + h * self.way) for h in (1e-6, -1e-6)]
        expected = (ends[0] - ends[1]) / 2e-6
        derivative = gradient @ self.way if gradient.size else np.zeros(len(found))
        scale = np.abs(expected).max(initial=1.0)
        np.testing.assert_allclose(derivative, expected, atol=1e-6 * scale)


def motion(rng) -> tuple[np.ndarray, np.ndarray]:
    """Returns a frame motion, and a way along which its quaternion stays unit."""
    value, way = 0.3 * rng.standard_normal((2, 19))
    value[:4] = ATTITUDE + 0.05 * rng.standard_normal(4)
    value[:4] /= np.linalg.norm(value[:4])
    way[:4] -= value[:4] * (value[:4] @ way[:4])
    return value, way


def signal(port, rng) -> tuple[np.ndarray, np.ndarray]:
    """Returns a value for a port, and a way along which it may go."""
    if port.size() == 19:
        return motion(rng)
    if port.size() == 36:
        return block_diag(K_O, K_P).ravel(), np.eye(6).ravel() * rng.uniform(0.5, 1.0)
    if port.get_name().endswith("scale"):
        return rng.uniform(0.5, 1.5, port.size()), rng.standard_normal(port.size())
    value, way = rng.standard_normal((2, port.size()))
    return value, way


@pytest.mark.parametrize("kind", CASES, ids=lambda kind: kind.__name__)
def test_a_block_has_derivatives_or_says_why_not(kind):
    block = CASES[kind][0]()
    block.set_name("named")
    if kind in WITH_DERIVATIVES:
        Fed(block, without=("stiffness_scale", "slack")).check()
    elif isinstance(block, Block):
        with pytest.raises(ConversionError, match=r"'named'.*`geoimp analyze`"):
            block.ToAutoDiffXd()
    else:
        with pytest.raises(RuntimeError, match="does not support scalar conversion"):
            block.ToAutoDiffXd()


@every_family
def test_each_family_with_gains_that_are_signals(name):
    Fed(make_impedance(name)).check()
    Fed(DirectImpedance(make_impedance(name).part)).check()


@pytest.mark.parametrize("name", ORIENTATION_LAWS)
def test_each_orientation_law(name):
    Fed(MotionController(orientation=name)).check()


def test_redundancy_of_seven_joints():
    model = track_arm()
    Fed(RedundancyResolver(model), model).check()


def test_sources_are_followed_over_time():
    segments = [MotionSegment(1.0, np.array([0.1, 0.0, 0.2]), np.array([0.0, 0.5, 0.0]))]
    source = DesiredMotion(RigidTransform(), segments)
    loop = ContinuousLoop(6, desired=source)
    context = loop.context()
    context.SetTime(0.4)
    converted = loop.diagram.ToAutoDiffXd()
    at = converted.CreateDefaultContext()
    at.SetTimeStateAndParametersFrom(context)
    D = converted.GetSubsystemByName("desired")
    found = D.get_output_port().Eval(D.GetMyContextFromRoot(at))
    np.testing.assert_array_equal([x.value() for x in found], source.evaluate(0.4))
    assert np.linalg.norm(linearize(loop.diagram, context).A()) > 1.0
    at.SetTime(AutoDiffXd(0.4, [1.0]))
    with pytest.raises(ConversionError, match="time"):
        D.get_output_port().Eval(D.GetMyContextFromRoot(at))
