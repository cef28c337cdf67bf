"""The cells: what they contain, and the postures that the experiments start from."""

import numpy as np
import pytest
from pydrake.geometry import SceneGraph
from pydrake.math import RollPitchYaw, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable, MultibodyForces, WeldJoint
from pydrake.systems.framework import Context

from geoimp_drake.diagrams.scene import cell
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.models import dh_to_joint
from geoimp_drake.typing import Array

DOWN = RotationMatrix(np.diag([1.0, -1.0, -1.0]))
FORWARD = RotationMatrix(np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]))
PITCH_88 = RotationMatrix.MakeYRotation(np.radians(88))
GENERIC = (
    RotationMatrix.MakeXRotation(2.5)
    @ RotationMatrix.MakeYRotation(0.6)
    @ RotationMatrix.MakeZRotation(0.3)
)
# (Denavit-Hartenberg angles [deg], position of the disk, its attitude, smallest singular value).
# The angles are printed to 0.01 degrees, so positions hold to a few tenths of a millimetre.
POSTURES = {
    "down": ([7.02, 68.29, -27.17, 0, -41.12, 7.02], (0.9, 0, 0.7), DOWN, 0.37),
    "down, low": ([7.02, 54.29, -29.44, 0, -24.85, 7.02], (0.9, 0, 0.5), DOWN, 0.27),
    "bar": ([8.82, 54.84, -47.57, 8.89, 82.81, 178.88], (1.1, 0, 0.8), FORWARD, 0.33),
    "bar, high": ([8.83, 75.05, -47.63, 9.93, 62.93, 175.45], (1.1, 0, 1.0), FORWARD, 0.33),
    "pitch 88": ([10.27, 68.76, -58.12, 10.38, 81.53, 178.09], (1.0, 0, 0.9), PITCH_88, 0.28),
    "generic": ([31.3, 74.1, -36.3, -72.4, -48.6, 93.1], (0.95, 0.1, 0.8), GENERIC, 0.26),
}


@pytest.fixture(scope="module", params=[("single_arm", cell.SIX), ("track_arm", cell.SEVEN)])
def arm(request: pytest.FixtureRequest) -> tuple[MultibodyPlant, str]:
    name, prefix = request.param
    plant = MultibodyPlant(time_step=1e-3)
    cell.add_cell(plant, name)
    plant.Finalize()
    return plant, prefix


def at_posture(plant: MultibodyPlant, posture: str) -> Context:
    """Returns a context with the arm in that posture, the track (if any) in the middle."""
    context = plant.CreateDefaultContext()
    q = np.zeros(plant.num_positions())
    q[-6:] = dh_to_joint(np.radians(POSTURES[posture][0]))
    plant.SetPositions(context, q)
    return context


def rotation_of_cell(prefix: str) -> RotationMatrix:
    return RotationMatrix.MakeZRotation(np.pi / 2 if prefix == cell.SEVEN else 0.0)


@pytest.mark.parametrize("posture", POSTURES)
def test_postures_put_the_disk_where_the_table_says(
    arm: tuple[MultibodyPlant, str], posture: str
) -> None:
    plant, prefix = arm
    _, p_BE, R_BE, _ = POSTURES[posture]
    X_WE = plant.GetFrameByName(cell.END_EFFECTOR).CalcPoseInWorld(at_posture(plant, posture))
    R_WB = rotation_of_cell(prefix)
    np.testing.assert_allclose(X_WE.translation(), R_WB @ np.array(p_BE), atol=8e-4)
    np.testing.assert_allclose(X_WE.rotation().matrix(), (R_WB @ R_BE).matrix(), atol=2e-3)


@pytest.mark.parametrize("posture", POSTURES)
def test_postures_are_inside_the_limits(arm: tuple[MultibodyPlant, str], posture: str) -> None:
    plant, _ = arm
    q = plant.GetPositions(at_posture(plant, posture))
    assert np.all(q > plant.GetPositionLowerLimits())
    assert np.all(q < plant.GetPositionUpperLimits())


@pytest.mark.parametrize("posture", POSTURES)
def test_postures_have_the_printed_distance_from_singularity(
    arm: tuple[MultibodyPlant, str], posture: str
) -> None:
    plant, _ = arm
    frame, world = plant.GetFrameByName(cell.END_EFFECTOR), plant.world_frame()
    context = at_posture(plant, posture)
    Jv_V_WE = plant.CalcJacobianSpatialVelocity(
        context, JacobianWrtVariable.kV, frame, np.zeros(3), world, world
    )
    sigma = np.linalg.svd(Jv_V_WE[:, -6:], compute_uv=False)[-1]
    assert round(sigma, 2) == POSTURES[posture][3]


@pytest.mark.parametrize("posture", POSTURES)
def test_motors_can_hold_the_postures_with_a_third_of_their_torque(
    arm: tuple[MultibodyPlant, str], posture: str
) -> None:
    plant, _ = arm
    torque = holding_torque(plant, at_posture(plant, posture))
    assert np.all(np.abs(torque) < plant.GetEffortUpperLimits() / 3)
    assert np.abs(torque[-5]) > 50  # the shoulder does carry the arm


def holding_torque(plant: MultibodyPlant, context: Context) -> Array:
    forces = MultibodyForces(plant)
    plant.CalcForceElementsContribution(context, forces)
    return plant.CalcInverseDynamics(context, np.zeros(plant.num_velocities()), forces)


def test_disk_is_a_quarter_of_a_metre_beyond_the_flange_and_aligned_with_it(
    arm: tuple[MultibodyPlant, str],
) -> None:
    plant, _ = arm
    X_FE = plant.GetFrameByName(cell.END_EFFECTOR).CalcPose(
        plant.CreateDefaultContext(), plant.GetFrameByName(cell.FLANGE)
    )
    np.testing.assert_allclose(X_FE.translation(), [0, 0, 0.25], atol=1e-12)
    np.testing.assert_allclose(RollPitchYaw(X_FE.rotation()).vector(), np.zeros(3), atol=1e-12)


def test_instances_are_called_after_the_arm_and_the_sensor_is_a_weld(
    arm: tuple[MultibodyPlant, str],
) -> None:
    plant, prefix = arm
    sensor = plant.GetModelInstanceByName(f"{prefix}_sensor")
    tool = plant.GetModelInstanceByName(f"{prefix}_tool")
    assert isinstance(plant.GetJointByName(cell.WRIST_SENSOR, sensor), WeldJoint)
    assert plant.HasBodyNamed("tool", tool)
    assert plant.num_actuated_dofs(plant.GetModelInstanceByName(prefix)) == plant.num_positions()


def test_track_moves_along_y_of_the_world_and_the_arm_faces_along_it() -> None:
    plant = MultibodyPlant(time_step=1e-3)
    added = cell.add_cell(plant, "track_arm")
    plant.Finalize()
    context = at_posture(plant, "down")
    before = plant.GetFrameByName(cell.END_EFFECTOR).CalcPoseInWorld(context).translation()
    plant.GetJointByName("track", added[cell.SEVEN]).set_translation(context, 0.3)
    after = plant.GetFrameByName(cell.END_EFFECTOR).CalcPoseInWorld(context).translation()
    np.testing.assert_allclose(after - before, [0, 0.3, 0], atol=1e-12)
    np.testing.assert_allclose(before[:2], [0, 0.9], atol=8e-4)


@pytest.mark.parametrize("name", cell.CELLS)
def test_every_part_can_be_seen_and_none_can_be_touched(name: str) -> None:
    plant, scene_graph = MultibodyPlant(time_step=1e-3), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    for instance in cell.add_cell(plant, name).values():
        for index in plant.GetBodyIndices(instance):
            body = plant.get_body(index)
            assert plant.GetVisualGeometriesForBody(body), body.name()
            assert not plant.GetCollisionGeometriesForBody(body), body.name()


def test_an_unknown_cell_is_refused_with_the_names_of_the_cells() -> None:
    with pytest.raises(ConfigurationError, match=r"'kitchen'.*single_arm, track_arm"):
        cell.add_cell(MultibodyPlant(time_step=1e-3), "kitchen")
