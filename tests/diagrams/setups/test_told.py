"""What the controller of the bar is told, where the scenario says more than that it holds one."""

import numpy as np
import pytest

from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.setups.tight_scenario import TightScenario
from geoimp_drake.systems.cooperation.cooperative_kinematics import ObjectLoad
from geoimp_drake.validation import check

BAR = ObjectLoad(mass=4.0)


def scenario(*settings: str) -> TightScenario:
    return get_experiment("bar").scenario((), settings)


def test_the_bar_is_what_the_controller_carries_unless_another_load_is_given() -> None:
    assert scenario().told(BAR).load is BAR
    given = scenario("load.mass=3", "load.inertial_load=none").told(BAR).load
    assert (given.mass, given.inertial_load) == (3.0, "none")


def test_a_given_mutual_pose_is_told_as_it_is() -> None:
    assert scenario().told(BAR).mutual_pose is None
    told = scenario("mutual_pose.position=[0, 0.9, 0]").told(BAR)
    np.testing.assert_array_equal(told.mutual_pose.position, [0.0, 0.9, 0.0])


def test_a_prescribed_mutual_pose_has_the_errors_that_are_assumed() -> None:
    errors = ("assumed.grasp_offset=[0.01, 0, 0]", "assumed.grasp_rotation_deg=[0, 0, 2]")
    told = scenario("assumed.prescribed=true", *errors).told(BAR)
    check(told)
    np.testing.assert_allclose(told.mutual_pose.position, [0.01, 1.0, 0.0])
    assert told.mutual_pose.quaternion[3] == pytest.approx(np.sin(np.deg2rad(1.0)))


def test_gains_of_the_scenario_are_those_of_the_controller() -> None:
    whole = scenario("redundancy_1.k_beta=2", "redundancy_2.k_beta=3")
    told = whole.told(BAR)
    assert told.impedance is whole.impedance
    assert (told.redundancy_1.k_beta, told.redundancy_2.k_beta) == (2.0, 3.0)
