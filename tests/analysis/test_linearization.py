"""A closed loop in continuous time is linearised in one call, through plant and blocks."""

import numpy as np
import pytest
from continuous_loop import K_W, ContinuousLoop
from impedance_rig import D_O, D_P, K_O, K_P, M_O, M_P
from law_numerics import every_family
from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, InitializeAutoDiff
from pydrake.geometry import AddCompliantHydroelasticProperties, ProximityProperties, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import (
    ApplySimulatorConfig,
    Simulator,
    Simulator_,
    SimulatorConfig,
)
from pydrake.systems.framework import DiagramBuilder
from scipy.linalg import block_diag

from geoimp_drake.analysis.linearization import linearize
from geoimp_drake.errors import ConversionError
from geoimp_drake.laws.prediction.modes import second_order_poles
from geoimp_drake.parts.null_space_gain import DEFAULT_KAPPA
from geoimp_drake.systems.arm.joint_readings import JointReadings

# f′(0) of the orientation errors: K_Po acts on the rotation vector times it.
SLOPES = {"quaternion": 0.5, "angle-axis-sin-half": 0.5, "angle-axis-tan-half": 0.5}


def poles_of_the_laws(family: str, redundant: int) -> np.ndarray:
    """Returns those of C on the wall and of the inner loop, then those of the null space."""
    slope = SLOPES.get(family, 1.0)
    M, D = block_diag(M_O, M_P), block_diag(D_O, D_P)
    # Against a small turn φ, K_o of a family is that of (3.30) whatever its displacement.
    C = second_order_poles(np.linalg.inv(M), D, block_diag(K_O, K_P + K_W))
    K_Pe = np.diag([4500.0 * slope] * 3 + [2025.0] * 3)
    inner = second_order_poles(np.eye(6), 65.0 * np.eye(6), K_Pe)
    # What moves no E is damped by κB and comes to rest anywhere; the norm of C's quaternion stays.
    return np.concatenate((C, inner, [0.0], [-DEFAULT_KAPPA, 0.0] * redundant))


def distance(found: np.ndarray, expected: np.ndarray) -> float:
    """Returns the largest relative difference of two sets of poles, one to one."""
    left, largest = list(found), 0.0
    for pole in expected:
        k = int(np.argmin(np.abs(np.array(left) - pole)))
        largest = max(largest, abs(left.pop(k) - pole) / max(1.0, abs(pole)))
    assert not left
    return largest


@every_family
def test_poles_of_six_joints_on_a_wall_are_those_of_the_laws(name):
    loop = ContinuousLoop(6, name)
    A = linearize(loop.diagram, loop.context()).A()
    assert distance(np.linalg.eigvals(A), poles_of_the_laws(name, 0)) < 1e-9


def test_poles_of_a_redundant_arm_have_those_of_its_null_space_besides():
    loop = ContinuousLoop(7)
    A = linearize(loop.diagram, loop.context()).A()
    assert distance(np.linalg.eigvals(A), poles_of_the_laws("quaternion", 1)) < 1e-9
    # Of the test.
    assert distance(np.linalg.eigvals(A), poles_of_the_laws("angle-axis-sin", 1)) > 0.1


def moving(loop: ContinuousLoop):
    """Returns a context in which everything is displaced and moves; C's quaternion is unit."""
    context, rng = loop.context(), np.random.default_rng(0)
    x = context.get_continuous_state_vector().CopyToVector()
    x += 0.05 * rng.standard_normal(len(x))
    Q = slice(len(x) - 13, len(x) - 9)
    x[Q] /= np.linalg.norm(x[Q])
    context.SetContinuousState(x)
    return context, x


@pytest.mark.parametrize("joints", [6, 7])
def test_derivatives_are_those_of_differences(joints):
    loop = ContinuousLoop(joints)
    context, x = moving(loop)
    u = loop.diagram.get_input_port()
    linear = linearize(loop.diagram, context, u, loop.diagram.get_output_port())

    def values(z):
        context.SetContinuousState(z[: len(x)])
        u.FixValue(context, z[len(x) :])
        rate = loop.diagram.EvalTimeDerivatives(context).CopyToVector()
        return np.concatenate((rate, loop.diagram.get_output_port().Eval(context)))

    z = np.concatenate((x, u.Eval(context)))
    # A quaternion of D that is not unit is refused: along its own directions nothing is compared.
    places = [k for k in range(len(z)) if not 0 <= k - len(x) < 4]
    step = 1e-6 * np.eye(len(z))
    expected = np.array([(values(z + step[k]) - values(z - step[k])) / 2e-6 for k in places]).T
    found = np.block([[linear.A(), linear.B()], [linear.C(), linear.D()]])[:, places]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())


def test_gradient_of_a_rollout_is_that_of_differences():
    loop = ContinuousLoop(6)
    context, x = moving(loop)
    config = SimulatorConfig(
        integration_scheme="runge_kutta2", max_step_size=1e-3, use_error_control=False
    )

    def rollout(simulator, start):
        ApplySimulatorConfig(config, simulator)
        root = simulator.get_mutable_context()
        root.SetTimeStateAndParametersFrom(context)
        root.SetContinuousState(start)
        simulator.get_system().get_input_port().FixValue(
            root, loop.diagram.get_input_port().Eval(context)
        )
        simulator.AdvanceTo(0.005)  # which begins with C on E
        return root.get_continuous_state_vector().CopyToVector()

    converted = loop.diagram.ToAutoDiffXd()
    end = rollout(Simulator_[AutoDiffXd](converted), InitializeAutoDiff(x).ravel())
    gradient = ExtractGradient(end.reshape(-1, 1))
    way = np.random.default_rng(1).standard_normal(len(x))
    ends = [rollout(Simulator(loop.diagram), x + sign * 1e-6 * way) for sign in (1.0, -1.0)]
    expected = (ends[0] - ends[1]) / 2e-6
    np.testing.assert_allclose(gradient @ way, expected, atol=1e-6 * np.abs(expected).max())


def test_what_is_discrete_is_named_and_sent_to_analyze():
    loop = ContinuousLoop(6, time_step=1e-3)
    with pytest.raises(ConversionError, match=r"'plant' is a discrete plant.*0\.001 s.*analyze"):
        linearize(loop.diagram, loop.diagram.CreateDefaultContext())
    readings = JointReadings(6)
    readings.set_name("readings")
    with pytest.raises(ConversionError, match=r"'readings' takes samples every .*geoimp analyze"):
        readings.ToAutoDiffXd()


def test_what_is_hydroelastic_is_named_and_sent_to_analyze():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    properties = ProximityProperties()
    AddCompliantHydroelasticProperties(0.01, 1e6, properties)
    plant.RegisterCollisionGeometry(
        plant.world_body(), RigidTransform(), Sphere(0.1), "cushion", properties
    )
    plant.Finalize()
    diagram = builder.Build()
    with pytest.raises(ConversionError, match=r"cushion' is hydroelastic.*geoimp analyze"):
        linearize(diagram, diagram.CreateDefaultContext())
