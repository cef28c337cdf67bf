"""Switching the controller on while the arm moves: no torque but that of the law."""

import numpy as np
import pytest
from arms import relative_error
from pydrake.math import RigidTransform
from rigs import ControlledArm, law_torque, make_controlled_arm, quick_config

from geoimp_drake.parts.wrist_sensor_config import WristSensorConfig
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.frame_motion import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
)
from geoimp_drake.task_functions.config import TaskConfig

SPEED = {6: np.array([0.3, -0.2, 0.25, 0.4, -0.3, 0.5]), 7: np.linspace(-0.3, 0.4, 7)}
AWAY = RigidTransform([0.01, -0.02, 0.015])


def moving_arm(joints: int, velocity: str) -> ControlledArm:
    """Returns an arm that moves, with D a little away from its hand; nothing is initialized."""
    # The tool's inertia must not be felt: it would be a step in the wrench, at its first sample.
    sensor = WristSensorConfig(inertial_load="plant")
    config = quick_config(velocity)
    config.redundancy.task = TaskConfig()  # the chapter's damping alone
    arm = make_controlled_arm(joints, config, X_DE=AWAY, sensor_config=sensor)
    arm.set_state(arm.rig.posture, SPEED[joints])
    return arm


def torque_by_the_law(arm: ControlledArm, C: np.ndarray) -> np.ndarray:
    """Returns (2.3) with (2.9), (2.15) at the arm's state for a motion of C, no wrench."""
    state, gains = arm.arm_state(), quick_config().motion
    error = quaternion.relative(state.Q_WE, C[QUATERNION])[1:]
    a_o = C[ANGULAR_ACCELERATION] + gains.K_Do * (C[ANGULAR_VELOCITY] - state.V_WE[:3])
    a_o = a_o + gains.K_Po * state.R_WE @ error
    a_p = C[LINEAR_ACCELERATION] + gains.K_Dp * (C[LINEAR_VELOCITY] - state.V_WE[3:])
    a_p = a_p + gains.K_Pp * (C[POSITION] - state.p_WE)
    return law_torque(arm.model(), state, np.concatenate((a_o, a_p)), np.zeros(6))


@pytest.mark.parametrize("joints", [6, 7])
@pytest.mark.parametrize("velocity", ["measured", "differenced"])
@pytest.mark.parametrize("initialized", [False, True])
def test_first_torque_is_that_of_the_law(joints: int, velocity: str, initialized: bool) -> None:
    arm = moving_arm(joints, velocity)
    if initialized:
        arm.simulator.Initialize()
    C = arm.read("compliant_motion")
    np.testing.assert_allclose(C[POSITION], arm.pose().translation(), atol=1e-12)
    np.testing.assert_array_equal(C[ANGULAR_VELOCITY], np.zeros(3))
    assert np.abs(C[LINEAR_ACCELERATION]).max() > 0.5  # D is away
    expected = torque_by_the_law(arm, C)
    # Both derivatives of J† are differences.
    assert relative_error(arm.read("actuation"), expected) < (1e-9 if joints == 6 else 1e-6)


@pytest.mark.parametrize("joints", [6, 7])
@pytest.mark.parametrize("velocity", ["measured", "differenced"])
def test_torque_does_not_jump_in_the_steps_after_it(joints: int, velocity: str) -> None:
    arm = moving_arm(joints, velocity)
    arm.simulator.Initialize()
    torques = [arm.read("actuation")]
    for k in range(1, 30):
        # A hair after the instant, so that its reading is taken.
        arm.simulator.AdvanceTo(k * 1e-3 + 1e-7)
        torques.append(arm.read("actuation"))
    change = np.abs(np.diff(torques, axis=0)).max(axis=1)
    peak = np.abs(np.array(torques) - torques[-1]).max()
    print(f"\n{joints} joints, {velocity}: greatest change {change.max():.2f} of {peak:.0f} Nm")
    # The transient decays with 65 1/s: 6.5 % a step, and the first change spans two steps.
    assert change.max() < 0.15 * peak
    assert peak > 5.0


@pytest.mark.parametrize("velocity", ["measured", "differenced"])
def test_switching_on_again_later_in_a_run_gives_no_jump_either(velocity: str) -> None:
    sensor = WristSensorConfig(inertial_load="plant")
    arm = make_controlled_arm(6, quick_config(velocity), sensor_config=sensor)
    arm.simulator.AdvanceTo(0.0505)
    arm.set_state(arm.rig.posture + 0.02, SPEED[6])
    arm.simulator.Initialize()
    state = arm.arm_state()
    C = arm.read("compliant_motion")
    np.testing.assert_allclose(C[POSITION], state.p_WE, atol=1e-12)
    first = arm.read("actuation")
    arm.simulator.AdvanceTo(0.0511)
    second = arm.read("actuation")
    assert relative_error(second, first) < 0.15
