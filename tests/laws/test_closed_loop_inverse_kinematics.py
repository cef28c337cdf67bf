"""Closed-loop inverse kinematics: the reference's error decays at the gain."""

import numpy as np
import pytest
from arms import POSTURES, make_arm_plant

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.laws.frame_motion import POSITION, QUATERNION, VELOCITY
from geoimp_drake.laws.motion_control.closed_loop_inverse_kinematics import (
    pose_error,
    reference_joint_velocity,
    reference_task_velocity,
)
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import (
    SingularityDamping,
    damped_pseudo_inverse,
)
from geoimp_drake.rotations import quaternion

GAIN, STEP = 20.0, 1e-6


def frame(seed: int, arm) -> np.ndarray:
    """Returns the motion of a frame near E, of any velocity."""
    rng, C = np.random.default_rng(seed), np.zeros(19)
    turn = np.concatenate(([1.0], 0.05 * rng.standard_normal(3)))
    C[QUATERNION] = quaternion.product(arm.Q_WE, turn / np.linalg.norm(turn))
    C[POSITION] = arm.p_WE + 0.02 * rng.standard_normal(3)
    C[VELOCITY] = rng.standard_normal(6)
    return C


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("joints", [6, 7])
def test_the_error_decays_at_the_gain_and_the_posture_moves_in_the_null_space_only(joints, sign):
    rig = make_arm_plant(joints=joints)
    dynamics = ChainDynamics(ControlModel.of_arm(rig.plant, rig.arm, rig.E))
    q = POSTURES[joints]
    arm = dynamics.evaluate(None, np.concatenate((q, np.zeros_like(q))))
    for seed in range(5):
        C = frame(seed, arm)
        C[QUATERNION] *= sign
        error = pose_error(C, arm.Q_WE, arm.p_WE)
        J_pinv, N = damped_pseudo_inverse(arm.Jv_V_WE, np.eye(joints), 1.0, SingularityDamping())
        to_posture = np.random.default_rng(seed).standard_normal(joints)
        V = reference_task_velocity(C, error, GAIN)
        v = reference_joint_velocity(V, J_pinv, N, to_posture)
        np.testing.assert_allclose(arm.Jv_V_WE @ v, C[VELOCITY] + GAIN * error, atol=1e-10)
        assert (np.linalg.norm(v - J_pinv @ V) > 0.1) == (joints == 7)

        # With C at rest the error a moment later is that of an exponential decay.
        v = reference_joint_velocity(GAIN * error, J_pinv, N, to_posture)
        later = dynamics.evaluate(None, np.concatenate((q + STEP * v, np.zeros_like(q))))
        change = (pose_error(C, later.Q_WE, later.p_WE) - error) / STEP
        np.testing.assert_allclose(
            change, -GAIN * error, rtol=0, atol=2e-2 * GAIN * np.abs(error).max()
        )
