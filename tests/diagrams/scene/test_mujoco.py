"""The cell in MuJoCo: the dynamics of Drake's plant, and surfaces that the press test knows."""

import mujoco
import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable

from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS
from geoimp_drake.diagrams.scene.mujoco_model import END_EFFECTOR_SITE, cell_spec
from geoimp_drake.diagrams.scene.mujoco_surface import MujocoPressRig
from geoimp_drake.diagrams.scene.press import measure
from geoimp_drake.diagrams.scene.surface import SURFACES
from geoimp_drake.diagrams.setups.single_arm import add_single_arm
from geoimp_drake.errors import ConfigurationError


@pytest.fixture(scope="module")
def arms():
    """Drake's plant with E, and MuJoCo's model of the same files."""
    plant = MultibodyPlant(1e-3)
    E, sensor_joint = add_single_arm(plant, EXPERIMENTS["consistency"].scenario())
    return plant, E, cell_spec(plant, "six", E, sensor_joint).compile()


@pytest.mark.parametrize("seed", range(3))
def test_mass_matrix_bias_gravity_and_jacobian_are_those_of_the_plant(arms, seed):
    plant, E, model = arms
    q, v = np.random.default_rng(seed).uniform(-1.5, 1.5, (2, 6))
    context, data = plant.CreateDefaultContext(), mujoco.MjData(model)
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    data.qpos[:], data.qvel[:] = q, v
    mujoco.mj_forward(model, data)
    M, J = np.zeros((6, 6)), np.zeros((6, 6))
    mujoco.mj_fullM(model, data, M)
    mujoco.mj_jacSite(model, data, J[3:], J[:3], model.site(END_EFFECTOR_SITE).id)
    bias = plant.CalcBiasTerm(context) - plant.CalcGravityGeneralizedForces(context)
    W = plant.world_frame()
    own = plant.CalcJacobianSpatialVelocity(context, JacobianWrtVariable.kV, E, np.zeros(3), W, W)
    assert np.abs(M - plant.CalcMassMatrix(context)).max() < 1e-10
    assert np.abs(data.qfrc_bias - bias).max() < 1e-10
    assert np.abs(J - own).max() < 1e-12
    X_WE = E.CalcPoseInWorld(context)
    assert np.abs(data.site_xpos[-1] - X_WE.translation()).max() < 1e-12


def test_friction_and_time_step_are_those_of_the_plant(arms):
    plant, _, model = arms
    damping = [
        joint.default_damping()
        for joint in map(plant.get_joint, plant.GetJointIndices())
        if joint.num_velocities()
    ]
    assert model.dof_damping.tolist() == damping
    assert model.opt.timestep == plant.time_step()


@pytest.mark.parametrize(
    ("name", "normal", "tilt"), [("plexiglas", 1e4, 20.0), ("cardboard", 5e3, 15.0)]
)
def test_the_press_test_measures_the_stiffnesses_that_drake_has(name, normal, tilt):
    result = measure(MujocoPressRig(SURFACES[name]), SURFACES[name])
    assert result.normal_stiffness == pytest.approx(normal, rel=2e-3)
    assert result.tilt_stiffness == pytest.approx([tilt, tilt], rel=2e-3)


def test_a_layer_that_diverges_at_the_time_step_is_refused():
    with pytest.raises(ConfigurationError, match=r"layer_stiffness 1e\+06 .* diverges in MuJoCo"):
        MujocoPressRig(SURFACES["plexiglas-stiff"])
