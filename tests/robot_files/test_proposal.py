"""What is proposed for an arm suits its mass, its actuators and its reach."""

import re
from pathlib import Path

import numpy as np
import pytest
from pydrake.multibody.tree import JacobianWrtVariable

from geoimp_drake import load_robot
from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.state import evaluate_arm
from geoimp_drake.errors import SingularityError
from geoimp_drake.robot_files.parsing import trial_plant
from geoimp_drake.robot_files.preflight import preflight
from geoimp_drake.robot_files.proposal import propose, propose_impedance

CASES = Path(__file__).parent / "cases"
LIGHT = (CASES / "light6.urdf").read_text()
SPHERES = (CASES / "spheres.urdf").read_text()


@pytest.fixture
def arm_of(tmp_path):
    def of(description: str):
        """Returns a plant with a robot in it, the robot, E and the scene graph."""
        file = tmp_path / "robot.urdf"
        file.write_text(description)
        plant, scene_graph = trial_plant()
        robot = load_robot(file, plant, end_effector="l6")
        plant.Finalize()
        return plant, robot.model_instance, robot.end_effector_frame, scene_graph

    return of


def heavier(description: str, factor: float) -> str:
    """Returns a robot with all masses and inertias multiplied."""
    scaled = r'\b(mass value|ixx|iyy|izz|effort)="([^"]*)"'
    return re.sub(scaled, lambda m: f'{m[1]}="{factor * float(m[2])}"', description)


def gains_of(proposal):
    impedance = proposal.impedance
    return np.array(
        [np.diag(K) for part in ("translation", "rotation") for K in impedance.gains(part)]
    )


def test_gains_and_push_grow_with_the_arms_mass_while_posture_and_motion_stay(arm_of):
    light, heavy = (propose(*arm_of(heavier(LIGHT, factor))) for factor in (1.0, 10.0))
    np.testing.assert_allclose(gains_of(heavy), 10.0 * gains_of(light), rtol=0.01)
    np.testing.assert_allclose(heavy.push, 10.0 * light.push, rtol=0.01)
    np.testing.assert_array_equal(heavy.posture, light.posture)
    np.testing.assert_array_equal(heavy.displacement, light.displacement)
    assert np.linalg.norm(light.displacement) == 0.07  # a tenth of the arm's 0.73 m


def test_radians_in_a_file_that_counts_in_degrees_are_guessed(arm_of):
    """Limits of ±3.14°, with which every posture of the arm is as good as singular."""
    narrow = re.sub(r'(lower|upper)="(-?)[^"]*"', rf'\1="\g<2>{np.deg2rad(3.14)}"', LIGHT)
    plant, arm, E, _ = arm_of(narrow)
    with pytest.raises(SingularityError, match=r"more than 6\.28° between.*compiler angle"):
        propose(plant, arm, E)


def test_the_hand_is_never_to_feel_lighter_than_it_is(arm_of):
    """M_p against what Drake says a force has to accelerate, attitude held: 1/mᵀΛ⁻¹m, least m."""
    plant, arm, E, scene_graph = arm_of(LIGHT)
    proposal = propose(plant, arm, E, scene_graph)
    context = plant.CreateDefaultContext()
    np.testing.assert_allclose(plant.GetPositions(context, arm), proposal.posture)
    W, wrt = plant.world_frame(), JacobianWrtVariable.kV
    J = plant.CalcJacobianSpatialVelocity(context, wrt, E, np.zeros(3), W, W)
    inverse = J @ np.linalg.inv(plant.CalcMassMatrix(context)) @ J.T
    # The attitude stays: of all wrenches with a given force the moment that keeps it.
    free = inverse[3:, 3:] - inverse[3:, :3] @ np.linalg.solve(inverse[:3, :3], inverse[:3, 3:])
    mass = 1.0 / np.linalg.eigvalsh(free)[-1]
    (M, D, K), _ = np.split(gains_of(proposal), 2)
    np.testing.assert_allclose(M, mass, rtol=5e-3)
    np.testing.assert_allclose(np.sqrt(K / M), 20.0, rtol=5e-3)
    np.testing.assert_allclose(D / (2 * np.sqrt(K * M)), 2.5, rtol=5e-3)


def test_a_slower_controller_gets_a_slower_impedance(arm_of):
    plant, arm, E, _ = arm_of(LIGHT)
    model = ControlModel.of_arm(plant, arm, E)
    x = np.concatenate((propose(plant, arm, E).posture, np.zeros(6)))
    state = evaluate_arm(model, model.plant.CreateDefaultContext(), x)
    M, D, K = propose_impedance(state, period=4e-3).gains("rotation")
    np.testing.assert_allclose(np.diag(K) / np.diag(M), (0.02 / 4e-3) ** 2, rtol=5e-3)
    np.testing.assert_allclose(4e-3 * np.diag(D) / np.diag(M), 0.1, rtol=5e-3)


def test_where_the_first_posture_cannot_be_held_or_touches_itself_another_is_taken(arm_of):
    """Shoulder's limit below what the first posture asks; balls that meet in a folded wrist."""
    strong = propose(*arm_of(SPHERES))
    plant, arm, E, scene_graph = arm_of(SPHERES.replace('effort="100"', 'effort="14"'))
    plant.SetDefaultPositions(arm, strong.posture)
    assert any("cannot be held" in text for text in preflight(plant, arm, E, scene_graph))
    weak = propose(plant, arm, E, scene_graph)
    assert preflight(plant, arm, E, scene_graph) == []
    assert not np.allclose(weak.posture, strong.posture)


def test_the_push_leaves_the_actuators_three_quarters_of_what_gravity_does(arm_of):
    plant, arm, E, scene_graph = arm_of(LIGHT.replace('effort="60"', 'effort="7"'))
    proposal = propose(plant, arm, E, scene_graph)
    model = ControlModel.of_arm(plant, arm, E)
    x = np.concatenate((proposal.posture, np.zeros(6)))
    state = evaluate_arm(model, model.plant.CreateDefaultContext(), x)
    torque = np.abs(state.Jv_V_WE[3:].T @ proposal.push)
    share = torque / (7.0 - np.abs(state.g))
    assert share.max() == pytest.approx(0.25, rel=0.01)
