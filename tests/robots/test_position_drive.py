"""An arm that takes joint positions, driven by the scheme admittance."""

from functools import cache

import numpy as np
import pytest
from driven_arm import PUSH, STIFFNESS, Between, DrivenArm, position_scenario

from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.setups.driven_arm import ScenarioDrive, simulated_robot
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.frame_motion import POSITION
from geoimp_drake.parts.supervisor import Mode
from geoimp_drake.robots.drive import Drive, DriveConfig
from geoimp_drake.robots.lcm_arm import LcmArm, LcmRobot
from geoimp_drake.simulation.run import simulate

TICK = 1e-3


@cache
def driven():
    """The scenario's own plant driven by positions: the last ticks, and the rows of a run."""
    drive = ScenarioDrive(position_scenario())
    log = drive.run()
    assert log.failure is None
    return log.values, drive.log(log)


def test_a_drive_by_positions_is_the_run_with_servos():
    scenario = position_scenario()
    setup = get_experiment("custom").build(scenario)
    outcome = simulate(setup.diagram, scenario.simulator, 0.9)
    assert outcome.failure is None
    run, drive = setup.recorder.collect(outcome.context), driven()[1]
    begins = []
    for log in (run, drive):
        D = log["mine/motion_D"][:, POSITION]
        begins.append(int(np.argmax(np.abs(np.diff(D, axis=0)).max(axis=1) > 1e-9)))
    # Until the push, which begins at a time of the plant and not of the motion.
    for name, bound in (("motion_D", 1e-9), ("motion_E", 2e-4)):
        one, other = (
            log[f"mine/{name}"][begin : begin + 45, POSITION]
            for log, begin in zip((run, drive), begins, strict=True)
        )
        assert np.abs(one - other).max() < bound, name


def test_a_pushed_hand_yields_as_the_impedance_says():
    ticks, _ = driven()
    k = np.flatnonzero(ticks["mode"][:, 0] == Mode.RUN)[-1]
    E, D = (ticks[f"motion_{frame}"][k, POSITION] for frame in "ED")
    way = [0.0, 0.0, PUSH / STIFFNESS]
    np.testing.assert_allclose(E - D, way, rtol=0, atol=1e-3 * way[2])


def test_positions_begin_where_the_arm_is_and_never_jump():
    ticks, _ = driven()
    np.testing.assert_array_equal(ticks["position"][0], ticks["q"][0])
    assert np.abs(np.diff(ticks["position"], axis=0)).max() < 1.0 * TICK
    assert np.isfinite(ticks["torque"]).all()  # what the servos exert
    # The first status has started it before the first tick is logged.
    modes = {Mode(int(mode)) for mode in ticks["mode"][:, 0]}
    assert modes == {Mode.SOFT_START, Mode.RUN, Mode.BRAKE, Mode.STOPPED}


@pytest.mark.parametrize("lost", ["silent", "NaN"])
def test_an_arm_whose_statuses_are_lost_stays_where_it_was_sent_and_stops(lost):
    scenario = position_scenario()
    robot = simulated_robot(scenario)

    def lose(count, status):
        if count < 700:
            return status
        if lost == "silent":
            return None
        status.q = np.full(7, np.nan)
        return status

    between = Between(robot, lose)
    log = ScenarioDrive(scenario, between).run()
    sent, modes = log.values["position"], log.values["mode"][:, 0]
    after = np.flatnonzero(modes >= Mode.HOLD)
    assert modes[-1] == Mode.STOPPED
    assert np.abs(np.diff(sent[after], axis=0)).max() == 0.0
    assert np.abs(np.diff(sent, axis=0)).max() < 1.0 * TICK
    assert between.stopped == 1


def test_what_a_robot_does_not_take_is_refused():
    scenario, arm = position_scenario(), DrivenArm("light7")
    with pytest.raises(
        ConfigurationError,
        match="takes a position of each joint, and the controller gives a torque",
    ):
        Drive(simulated_robot(scenario), arm.loop, DriveConfig(wrench="robot"))
    with pytest.raises(
        ConfigurationError,
        match="takes a torque of each joint, and the controller gives a position",
    ):
        ScenarioDrive(scenario, arm.robot)
    with pytest.raises(ConfigurationError, match="Give wrench: robot"):
        ScenarioDrive(position_scenario("robot.driver.wrench=observer"))
    with pytest.raises(ConfigurationError, match="this driver of a Franka arm sends torques"):
        ScenarioDrive(position_scenario("robot.driver={kind: franka, address: 172.16.0.2}"))
    with pytest.raises(ConfigurationError, match="messages of an iiwa"):
        LcmArm("panda", "", ("j1",), takes="position")
    with pytest.raises(ConfigurationError, match="messages of an iiwa"):
        LcmRobot(simulated_robot(scenario), "panda", "")
    with pytest.raises(ConfigurationError, match="Unknown takes 'speed'"):
        LcmArm("iiwa", "", ("j1",), takes="speed")
