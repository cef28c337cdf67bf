"""The tool's load by the law is what Drake's inverse dynamics of the tool says."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces, SpatialInertia

from geoimp_drake.laws.sensing.sensed_wrench import (
    inertial_acceleration,
    load_of_tool,
    shifted_moment,
)
from geoimp_drake.rotations import so3

GRAVITY = np.array([0.4, -0.7, -9.81])
INERTIA = SpatialInertia.SolidBoxWithMass(1.7, 0.05, 0.09, 0.2).Shift([0.02, -0.03, -0.1])


def free_body() -> MultibodyPlant:
    plant = MultibodyPlant(0.0)
    plant.mutable_gravity_field().set_gravity_vector(GRAVITY)
    plant.AddRigidBody("tool", INERTIA)
    plant.Finalize()
    return plant


def random_motion(rng: np.random.Generator) -> tuple[RigidTransform, np.ndarray, np.ndarray]:
    """Returns X_WT, [ω; v] and [ω̇; v̇] of the tool's origin."""
    X_WT = RigidTransform(RollPitchYaw(rng.uniform(-1.4, 1.4, 3)), rng.uniform(-1, 1, 3))
    return X_WT, rng.uniform(-3, 3, 6), rng.uniform(-8, 8, 6)


def load_by_drake(X_WT: RigidTransform, V: np.ndarray, A: np.ndarray) -> np.ndarray:
    """Returns [moment about the tool's origin; force] that must act on the tool, in W."""
    plant = free_body()
    context = plant.CreateDefaultContext()
    tool = plant.GetBodyByName("tool")
    plant.SetFloatingBaseBodyPoseInWorldFrame(context, tool, X_WT)
    plant.SetVelocities(context, V)
    forces = MultibodyForces(plant)
    plant.CalcForceElementsContribution(context, forces)
    return plant.CalcInverseDynamics(context, A, forces)


def load_by_law(X_WT: RigidTransform, V: np.ndarray, A: np.ndarray) -> np.ndarray:
    R = X_WT.rotation().matrix()
    p_SC = R @ INERTIA.get_com()
    about_C = INERTIA.Shift(INERTIA.get_com()).CalcRotationalInertia().CopyToFullMatrix3()
    a_WC = inertial_acceleration(A[3:], V[:3], A[:3], p_SC)
    moment, force = load_of_tool(
        INERTIA.get_mass(), p_SC, R @ about_C @ R.T, GRAVITY, a_WC, V[:3], A[:3]
    )
    return np.concatenate((moment, force))


@pytest.mark.parametrize("seed", range(10))
def test_load_of_a_moving_tool_is_that_of_inverse_dynamics(seed: int) -> None:
    motion = random_motion(np.random.default_rng(seed))
    expected = load_by_drake(*motion)
    assert np.linalg.norm(expected[:3]) > 0.1
    np.testing.assert_allclose(load_by_law(*motion), expected, atol=1e-12)


def test_load_at_rest_is_the_weight_alone() -> None:
    X_WT, _, _ = random_motion(np.random.default_rng(5))
    load = load_by_law(X_WT, np.zeros(6), np.zeros(6))
    np.testing.assert_allclose(load[3:], -INERTIA.get_mass() * GRAVITY, atol=1e-12)
    np.testing.assert_allclose(load, load_by_drake(X_WT, np.zeros(6), np.zeros(6)), atol=1e-12)


def test_acceleration_of_a_point_is_the_second_derivative_of_its_place() -> None:
    w, p, h = np.array([0.3, -1.1, 0.8]), np.array([0.2, 0.1, -0.4]), 1e-4

    def place(t: float) -> np.ndarray:
        # Turns at ω about a fixed axis, faster and faster: ω̇ = 2 ω.
        return so3.exp(w * (t + t * t)) @ p

    numeric = (place(h) - 2 * place(0.0) + place(-h)) / h**2
    a = inertial_acceleration(np.zeros(3), w, 2 * w, p)
    np.testing.assert_allclose(a, numeric, atol=1e-6)


def test_shifted_wrench_is_the_same_wrench_about_another_point() -> None:
    rng = np.random.default_rng(1)
    moment, force, p_AB = rng.standard_normal((3, 3))
    expected = SpatialForce(moment, force).Shift(p_AB)
    np.testing.assert_allclose(shifted_moment(moment, force, p_AB), expected.rotational())
