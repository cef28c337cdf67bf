"""What a scenario with a robot of one's own leaves out has the values that one would write."""

import numpy as np
import pytest
from driven_arm import LIGHT
from published_arms import write_dual_urdf

from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.setups.driven_arm import ScenarioDrive
from geoimp_drake.diagrams.setups.own_robot import propose_scenario
from geoimp_drake.diagrams.setups.single_arm import build_single_arm
from geoimp_drake.scenario.loading import dump_scenario
from geoimp_drake.scenario.yaml_text import parse_yaml

ROBOT = {"file": str(LIGHT), "end_effector": "l7", "geometry": "leave-out"}
SHORT = {"robot": ROBOT, "duration": 0.1}
WRITTEN_OUT = {**SHORT, "arm": "arm", "start": {"position": None}}
PLACE = [0.4, 0.0, 0.3]


def loaded(*layers, overrides=(), experiment="custom"):
    return get_experiment(experiment).scenario(layers, overrides)


@pytest.mark.parametrize("overrides", [(), ("robot.driver.kind=lcm", "seed=3")])
def test_a_name_and_a_start_that_are_left_out_are_those_that_one_would_write(overrides):
    short, written = (dump_scenario(loaded(s, overrides=overrides)) for s in (SHORT, WRITTEN_OUT))
    assert short == written
    assert dump_scenario(loaded(parse_yaml(short, "short"))) == short


def test_what_is_written_stays_whatever_is_laid_over_it():
    own = {**SHORT, "arm": "mine", "start": {"position": PLACE, "tilt_deg": 5.0}}
    for overrides in ((), ("robot.driver.kind=lcm",), (f"robot.file={LIGHT}",)):
        scenario = loaded(own, overrides=overrides)
        assert scenario.arm == "mine"
        np.testing.assert_array_equal(scenario.start.position, PLACE)
    assert loaded({**SHORT, "arm": "six"}, overrides=("robot.driver.kind=lcm",)).arm == "six"


def test_a_robot_in_an_experiment_has_the_name_of_its_own_and_the_experiments_start():
    usual = loaded(experiment="redundancy")
    for layers, overrides in (
        ((SHORT,), ()),
        ((), tuple(f"robot.{k}={v}" for k, v in ROBOT.items())),
    ):
        scenario = loaded(*layers, overrides=overrides, experiment="redundancy")
        assert (usual.arm, scenario.arm) == ("seven", "arm")
        np.testing.assert_array_equal(scenario.start.position, usual.start.position)


def test_the_scenario_that_init_writes_has_these_values():
    own = propose_scenario(LIGHT).scenario
    assert (own.arm, own.start.position) == (loaded(SHORT).arm, loaded(SHORT).start.position)


@pytest.mark.parametrize("hand", ["left_tool0", "right_tool0"])
def test_either_arm_of_a_file_with_two_starts_and_is_called_so(hand, tmp_path):
    robot = {"file": str(write_dual_urdf(tmp_path)), "end_effector": hand, "geometry": "leave-out"}
    short, written = (loaded({**layer, "robot": robot}) for layer in (SHORT, WRITTEN_OUT))
    plants = [build_single_arm(scenario, logged=False).plant for scenario in (short, written)]
    assert short.start.posture == written.start.posture
    for plant in plants:
        assert plant.GetModelInstanceName(plant.GetFrameByName(hand).model_instance()) == "arm"


def test_a_drive_begins_where_a_run_does():
    """Behind its interface, too, the scenario's own plant is in the posture that is found."""
    run, drive = loaded(SHORT), loaded(SHORT)
    build_single_arm(run, logged=False)
    status, _ = ScenarioDrive(drive).look()
    np.testing.assert_allclose(status.q, run.start.posture, rtol=0, atol=1e-6)
