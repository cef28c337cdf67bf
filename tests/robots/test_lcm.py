"""An arm behind Drake's LCM messages: both ends, in two processes, with no other traffic."""

import numpy as np
import pytest
from driven_arm import PUSH, STIFFNESS
from lcm_trial import in_own_network
from live_trial import another_try

from geoimp_drake.robots.lcm_messages import LCM_MESSAGES
from geoimp_drake.robots.robot_arm import RobotStatus

ROBOTS = sorted(LCM_MESSAGES)


@another_try
@pytest.mark.parametrize("wrench", ["observer", "robot"])
@pytest.mark.parametrize("robot", ROBOTS)
def test_a_pushed_hand_yields_as_the_impedance_says(robot, wrench):
    found = in_own_network("push", robot, wrench)
    way = [0.0, 0.0, PUSH / STIFFNESS]
    np.testing.assert_allclose(found["way"], way, rtol=0, atol=5e-3 * way[2])
    h = [0.0, 0.0, 0.0, 0.0, 0.0, -PUSH]
    np.testing.assert_allclose(found["wrench"], h, rtol=0, atol=5e-3 * PUSH)


@another_try
def test_the_hand_of_an_iiwa_that_takes_positions_yields_as_the_impedance_says():
    found = in_own_network("positions")
    way = [0.0, 0.0, PUSH / STIFFNESS]
    np.testing.assert_allclose(found["way"], way, rtol=0, atol=1e-3 * way[2])
    assert found["jump"] < 1e-12  # the first position sent is the one measured


@another_try
@pytest.mark.parametrize("robot", ROBOTS)
def test_what_is_no_status_counts_as_none_and_another_arm_is_refused(robot):
    found = in_own_network("faults", robot)
    assert "does not answer" in found["silent"]
    assert found["read"] == [True, False, False]  # a good one, without a time, without joints
    assert not found["stale"]  # what came before the torques were taken over
    assert "reports 6 joints; the controller has 7" in found["other"]


@pytest.mark.parametrize("robot", ROBOTS)
def test_messages_say_what_was_meant(robot):
    q, v, torque, external = np.random.default_rng(1).normal(size=(4, 7))
    messages = LCM_MESSAGES[robot]
    status = RobotStatus(1.25, q, v, torque, external_torque=external)
    message = messages.status_type.decode(messages.write_status(status).encode())
    read = messages.read_status(message)
    for name in ("time", "q", "v", "torque", "external_torque"):
        np.testing.assert_allclose(getattr(read, name), getattr(status, name), atol=1e-15)
    command = messages.write_command(message, torque)
    sent = messages.command_type.decode(command.encode())
    np.testing.assert_array_equal(messages.read_command(sent), torque)
    assert sent.utime == message.utime
    if messages.write_position is not None:
        sent = messages.command_type.decode(messages.write_position(message, q).encode())
        np.testing.assert_array_equal(messages.read_position(sent), q)
        assert messages.read_command(sent) is None  # no torques


def test_an_iiwa_reports_what_acts_on_its_joints_a_panda_what_they_exert():
    pushed = RobotStatus(1.0, *np.zeros((3, 7)), external_torque=np.ones(7))
    signs = {
        robot: LCM_MESSAGES[robot].write_status(pushed).joint_torque_external[0] for robot in ROBOTS
    }
    assert signs == {"iiwa": 1.0, "panda": -1.0}


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_command_without_torques_commands_nothing(robot):
    assert LCM_MESSAGES[robot].read_command(LCM_MESSAGES[robot].command_type()) is None
