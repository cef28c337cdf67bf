"""Torques go from one controller to another without a jump, at rest, pushed, and with an error."""

import numpy as np
import pytest
from driven_arm import STIFFNESS, DrivenArm, gains

from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.controllers.impedance_config import ImpedanceConfig
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.frame_motion import ACCELERATION, POSITION
from geoimp_drake.laws.impedance.families import FAMILIES
from geoimp_drake.parts.hand_over import HandOver, desired_at_equilibrium
from geoimp_drake.parts.part_loop import PartLoop
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.frame_motion import frame_motion_at_rest

PUSH = np.array([0.4, -0.3, 0.2, 9.0, 0.0, -12.0])  # 15 N


def at_rest() -> np.ndarray:
    motion = np.zeros(19)
    motion[:4] = quaternion.exp(np.array([0.3, 2.5, -0.4]))
    motion[POSITION] = [0.7, 0.1, 0.5]
    return motion


@pytest.mark.parametrize("family", FAMILIES)
def test_c_stays_at_rest_under_the_wrench(family):
    config = ImpedanceConfig(orientation=family)
    config.rotation.stiffness = np.array([12.0, 8.0, 10.0])
    impedance = config.make()
    C = at_rest()
    D = desired_at_equilibrium(impedance, C, PUSH)
    motion = impedance.motion_of(D, PUSH, C[:13])
    np.testing.assert_allclose(motion[ACCELERATION], 0.0, atol=1e-8)
    np.testing.assert_allclose(D[POSITION] - C[POSITION], PUSH[3:] / 700.0, rtol=0, atol=1e-10)


def test_a_coupled_stiffness_has_an_equilibrium_too():
    config = ImpedanceConfig(coupling=np.array([[0.0, 4.0, 0.0], [0.0, 0.0, 3.0], [5.0, 0.0, 0.0]]))
    impedance = config.make()
    D = desired_at_equilibrium(impedance, at_rest(), 0.5 * PUSH)
    motion = impedance.motion_of(D, 0.5 * PUSH, at_rest()[:13])
    np.testing.assert_allclose(motion[ACCELERATION], 0.0, atol=1e-8)


def test_a_wrench_beyond_the_springs_is_named():
    with pytest.raises(ConfigurationError, match=r"100\.0.*'quaternion'"):
        desired_at_equilibrium(ImpedanceConfig().make(), at_rest(), np.array([100.0] * 6))


def test_an_impedance_that_starts_in_contact_asks_for_the_torques_that_act():
    """Pushed with 15 N: the torque jumps by 21 Nm if C starts with D on E, else by nothing."""
    arm = DrivenArm()
    status = arm.robot.connect()
    q, v = status.q, np.zeros_like(status.v)
    first = arm.loop
    C = frame_motion_at_rest(arm.X_WE)
    D = desired_at_equilibrium(first.impedance, C, PUSH)
    acting = first.reset(q, v, PUSH, D)
    second = ControlLoop(
        arm.plant,
        arm.plant.GetModelInstanceByName("robot"),
        arm.plant.GetFrameByName("flange"),
        gains(),
        gravity="robot",
        joints=arm.robot.joints,
    )
    np.testing.assert_allclose(second.reset(q, v, PUSH, D), acting, rtol=0, atol=1e-4)
    assert abs(second.reset(q, v, PUSH) - acting).max() > 5.0
    way = D[POSITION] - C[POSITION]
    np.testing.assert_allclose(way, PUSH[3:] / STIFFNESS, rtol=0, atol=1e-10)


def handed_over(first: np.ndarray, second: np.ndarray, ticks: int = 800) -> np.ndarray:
    """Returns the torques of a change from one constant torque to another after 100 ticks."""
    loop = PartLoop(HandOver(len(first)), "hand over")
    signals = {"torque_1": first, "torque_2": second, "selected": np.zeros(1)}
    loop.reset(signals)
    rows = []
    for k in range(ticks):
        loop.step({**signals, "selected": np.array([float(k >= 100)])}, {}, 1e-3)
        rows.append(loop.output("torque").copy())
    return np.array(rows)


def test_a_name_that_a_loop_does_not_have_is_refused_with_those_that_it_has():
    loop = PartLoop(HandOver(2), "hand over")
    with pytest.raises(
        ConfigurationError, match=r"input of hand over 'torque_3'.*torque_1, torque_2"
    ):
        loop.input("torque_3")
    with pytest.raises(ConfigurationError, match=r"output of hand over 'torques'.*Valid: .*torque"):
        loop.output("torques")


def test_a_difference_fades_out():
    first, second = np.array([10.0, -4.0]), np.array([12.7, -4.0])
    torque = handed_over(first, second)
    np.testing.assert_array_equal(torque[:100], np.tile(first, (100, 1)))
    np.testing.assert_allclose(torque[602:], np.tile(second, (198, 1)), rtol=0, atol=1e-12)
    # The steepest slope of the polynomial is 1.875 over the fade.
    assert np.abs(np.diff(torque, axis=0)).max() <= 1.01 * 1.875 * 2.7 * 1e-3 / 0.5


def test_equal_torques_stay_what_they_are():
    same = np.array([3.0, -2.0, 1.0])
    np.testing.assert_allclose(handed_over(same, same), np.tile(same, (800, 1)), atol=1e-12)
