"""A simulated robot rests until it is commanded, and says what pushes it."""

import time

import numpy as np
import pytest
from driven_arm import DrivenArm
from pydrake.multibody.tree import JacobianWrtVariable

from geoimp_drake.robots.lcm_arm import LcmRobot
from geoimp_drake.robots.lcm_messages import LCM_MESSAGES
from geoimp_drake.systems.sources.external_wrench import WrenchRamp

PUSH = WrenchRamp(force=np.array([3.0, 0.0, 15.0]), start=0.05, duration=0.05, blend=0.01)


@pytest.fixture
def arm():
    return DrivenArm("light7", push=PUSH)


def pushed(arm, *, is_held: bool) -> tuple[np.ndarray, np.ndarray]:
    """Returns how far joints have turned after 0.2 s, and where they are."""
    first = arm.robot.connect().q
    arm.robot.brake(is_held)
    for _ in range(200):
        status = arm.robot.read()
    return status.q - first, status.q


def test_brakes_hold_a_pushed_arm_whose_joints_feel_the_push(arm):
    turned, q = pushed(arm, is_held=True)
    np.testing.assert_array_equal(turned, 0.0)
    plant, W = arm.plant, arm.plant.world_frame()
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    J = plant.CalcJacobianTranslationalVelocity(
        context, JacobianWrtVariable.kV, plant.GetFrameByName("l7"), np.zeros(3), W, W
    )
    felt = arm.robot.external_torque()
    np.testing.assert_allclose(felt, J.T @ PUSH.force, rtol=0, atol=1e-9)


def test_without_brakes_it_gives_way(arm):
    assert np.abs(pushed(arm, is_held=False)[0]).max() > 1e-2


def test_a_robot_on_lcm_rests_until_it_is_commanded(arm):
    first = arm.robot.connect().q
    LcmRobot(arm.robot, "iiwa", "memq://", 5e-3).run(0.3)
    np.testing.assert_array_equal(arm.robot.read().q, first)


def test_a_robot_on_lcm_that_is_late_takes_its_commands(arm, monkeypatch):
    """A step of 1 ms takes 2 ms, so there is never time to wait for a command."""
    read, messages = arm.robot.read, LCM_MESSAGES["iiwa"]
    monkeypatch.setattr(arm.robot, "read", lambda: (time.sleep(2e-3), read())[1])
    robot = LcmRobot(arm.robot, "iiwa", "memq://", 5e-3)

    def answer(data: bytes) -> None:
        command = messages.write_command(messages.status_type.decode(data), np.zeros(7))
        robot._lcm.Publish("IIWA_COMMAND", command.encode())

    robot._lcm.Subscribe("IIWA_STATUS", answer)
    first = arm.robot.connect().q
    robot.run(0.2)
    assert np.abs(read().q - first).max() > 1e-2
