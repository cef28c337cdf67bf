"""Robot files that show faults of loading: each is driven, and its dynamics are Drake's."""

from pathlib import Path

import numpy as np
import pytest
from pressed_hand import press
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

import geoimp_drake
from geoimp_drake.controllers.impedance_config import ImpedanceConfig
from geoimp_drake.robot_files.loading import load_robot

CASES = Path(__file__).parent / "cases"
# Of each file: the end effector, and what had to be done.
DRIVEN = {
    "almost.urdf": ("l6", "inertias replaced by the nearest of a body: l1 (0.99% off)"),
    "base_from_mesh.xml": ("hand", "geometry left out"),
    "damped.urdf": ("l6", ""),
    "floating.urdf": ("l6", "floating base welded: link base to floor"),
    "light6.urdf": ("l6", ""),
    "light7.urdf": ("l7", ""),
    "mass0_base.urdf": ("l6", "inertias replaced by the nearest of a body: base (no mass)"),
    "nested.sdf": ("palm", "nested models made one with that around them: arm, hand"),
    "no_inertia.urdf": ("l6", "links without mass estimated as solids of 1000 kg/m³: l1 0.268 kg"),
    "no_model.xml": ("hand", "servos replaced by torque actuators: j1, j2, j3, j4, j5"),
    "planar.urdf": ("l6", "planar joint rail made of rail_x, rail_y, rail_turn"),
    "servo_armature.xml": ("hand", "servos replaced by torque actuators: j1, j2, j3, j4, j5"),
    "six_touching.urdf": ("l6", ""),
    "spheres.urdf": ("l6", ""),
    "twice_motor.urdf": ("l6", ""),
    "ws/foo/urdf/r.urdf": ("l6", "actuators added: j1, j2, j3, j4, j5, j6"),
}


def gentle() -> geoimp_drake.ImpedanceControllerConfig:
    impedance = ImpedanceConfig()
    impedance.translation.mass = np.array(5.0)
    impedance.translation.damping = np.array(200.0)
    impedance.translation.stiffness = np.array(500.0)
    impedance.rotation.mass = np.array(0.2)
    impedance.rotation.damping = np.array(4.0)
    impedance.rotation.stiffness = np.array(10.0)
    return geoimp_drake.ImpedanceControllerConfig(impedance=impedance)


@pytest.mark.parametrize("case", DRIVEN)
def test_each_case_is_driven_and_its_hand_is_where_the_law_says(case):
    end_effector, change = DRIVEN[case]

    def load(plant):
        return load_robot(CASES / case, plant, end_effector=end_effector, geometry="leave-out")

    pressed = press(load, gentle(), np.array([3.0, -2.0, 4.0]), 0.3)
    assert change == "" or any(done.startswith(change) for done in pressed.robot.changes)
    error = np.linalg.norm(pressed.X_WE.translation() - pressed.p_WC)
    moved = np.linalg.norm(pressed.X_WE.translation() - pressed.X_WD.translation())
    print(f"\n{case}: E {error * 1e3:.4f} mm off C, pressed by {moved * 1e3:.1f} mm")
    assert np.isfinite(pressed.actuation).all()
    assert error < 5e-5
    assert 1e-3 < moved < 0.02


READ_BY_DRAKE = ["mass0_base.urdf", "ws/foo/urdf/r.urdf", "light7.urdf", "spheres.urdf"]


@pytest.mark.parametrize("case", READ_BY_DRAKE)
def test_dynamics_are_those_of_the_file_where_drake_reads_it(case):
    raw, plant = MultibodyPlant(1e-3), MultibodyPlant(1e-3)
    parser = Parser(raw)
    parser.package_map().Add("foo", str(CASES / "ws" / "foo"))
    parser.AddModels(str(CASES / case))
    raw.WeldFrames(raw.world_frame(), raw.GetFrameByName("base"))
    load_robot(CASES / case, plant, end_effector=DRIVEN[case][0], geometry="leave-out")
    found, expected = (_dynamics(p, DRIVEN[case][0]) for p in (plant, raw))
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)


def _dynamics(plant, E):
    plant.Finalize()
    context = plant.CreateDefaultContext()
    n = plant.num_velocities()
    plant.SetPositions(context, np.linspace(-0.4, 0.9, n))
    plant.SetVelocities(context, np.linspace(0.8, -0.5, n))
    yield plant.GetFrameByName(E).CalcPoseInWorld(context).GetAsMatrix4()
    yield plant.CalcMassMatrix(context)
    yield plant.CalcBiasTerm(context)
    yield plant.CalcGravityGeneralizedForces(context)
