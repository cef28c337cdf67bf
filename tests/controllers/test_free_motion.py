"""Our six-joint arm in free motion: what the sensor reads with the tool's load removed."""

import numpy as np
import pytest
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator

from geoimp_drake.diagrams.setups.single_arm import build_single_arm
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.models import dh_to_joint
from geoimp_drake.systems.sources.desired_motion import MotionSegment

# The displacement of the first case, down 0.18 m, but in 1.5 s instead of the first part of 7 s.
# Its greatest acceleration is fifteen times that of the case's free part.
MOTION = MotionSegment(1.5, np.array([0.0, 0.0, -0.18]))
POSTURE_DEG = np.array([7.02, 68.29, -27.17, 0.0, -41.12, 7.02])  # Denavit-Hartenberg


def free_wrench(inertial_load: str) -> tuple[np.ndarray, np.ndarray]:
    """Returns the measured wrench of every logged sample, and the way of the hand."""
    scenario = SingleArmScenario(surface=None, segments=[MOTION])
    scenario.start.position = np.array([0.9, 0.0, 0.7])
    scenario.start.guess = dh_to_joint(np.deg2rad(POSTURE_DEG))
    scenario.start.tilt_deg = 10.0
    scenario.sensor.inertial_load = inertial_load
    scenario.sensor.force_range, scenario.sensor.moment_range = 130.0, 10.0
    setup = build_single_arm(scenario)
    simulator = Simulator(setup.diagram)
    ApplySimulatorConfig(setup.scenario.simulator, simulator)
    simulator.AdvanceTo(MOTION.duration)
    log = setup.recorder.collect(simulator.get_context())
    return log["six/wrench"], log["six/motion_E"][:, 4:7] - log["six/motion_E"][0, 4:7]


def peaks(inertial_load: str) -> tuple[float, float]:
    """Returns the greatest force and moment [N, Nm]."""
    wrench, way = free_wrench(inertial_load)
    assert way[-1, 2] < -0.14
    force = np.linalg.norm(wrench[:, 3:], axis=1).max()
    moment = np.linalg.norm(wrench[:, :3], axis=1).max()
    print(f"\ninertial load removed by {inertial_load}: {force:.1e} N, {moment:.1e} Nm")
    return float(force), float(moment)


@pytest.mark.parametrize("inertial_load", ["plant", "reference"])
def test_little_is_felt_in_free_motion_when_the_inertial_load_is_removed(inertial_load) -> None:
    force, moment = peaks(inertial_load)
    assert force < 0.2
    assert moment < 0.02


def test_inertial_load_is_felt_when_it_is_not_removed() -> None:
    force, _ = peaks("none")
    assert 0.2 < force < 5.0
