"""A proposed scenario stays calm where its hand meets something hard."""

from pathlib import Path

import numpy as np

from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.scene.surface_config import SurfaceConfig
from geoimp_drake.diagrams.scene.surface_placement import SurfacePlacement
from geoimp_drake.diagrams.setups.own_robot import propose_scenario
from geoimp_drake.diagrams.setups.single_arm import build_single_arm
from geoimp_drake.simulation.experiment import run_experiment
from geoimp_drake.systems.sources.desired_motion import MotionSegment

LIGHT = Path(__file__).parents[2] / "robot_files" / "cases" / "light6.urdf"
# Layer and mount in series: 1.7e5 N/m, some 400 times the impedance's stiffness.
HARD = SurfaceConfig(
    layer_stiffness=1e6,
    mount_stiffness=2e5,
    mount_damping=600.0,
    mount_tilt_stiffness=2000.0,
    mount_tilt_damping=2.0,
    plate_mass=5.0,
)


def test_the_proposed_gains_do_not_ring_on_a_surface_of_170_kN_per_metre(tmp_path):
    """The disk, in line with the surface, is led 30 mm behind it; the force comes to rest."""
    own = propose_scenario(LIGHT)
    scenario = own.scenario
    scenario.form, scenario.external = "compiled", None
    plant = build_single_arm(scenario).plant
    X_WE = plant.GetFrameByName("l6").CalcPoseInWorld(plant.CreateDefaultContext())
    forward = X_WE.rotation().col(2)
    scenario.surface = SurfacePlacement(X_WE.translation() + 0.01 * forward, -forward, HARD)
    scenario.segments = [MotionSegment(1.0, 0.04 * forward), MotionSegment(2.0)]
    scenario.duration = 3.0
    run = run_experiment(get_experiment("custom"), scenario, tmp_path, figures=False)
    force = run.log["arm/wrench"][:, 3:] @ forward
    _, _, K_p = scenario.impedance.gains("translation")
    np.testing.assert_allclose(force[-1], 0.03 * K_p[0, 0], rtol=0.01)
    assert np.ptp(force[-50:]) < 0.01 * force[-1]
    assert run.failure is None
