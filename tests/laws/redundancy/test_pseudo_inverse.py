"""The weighted pseudo-inverse: what it inverts, and why its weight is the inertia matrix."""

import numpy as np
import pytest
from arms import make_arm_plant

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.state import ArmState, evaluate_arm
from geoimp_drake.laws.motion_control.resolved_acceleration import resolved_acceleration
from geoimp_drake.laws.redundancy.pseudo_inverse import weighted_pseudo_inverse


def arm_state(joints: int, seed: int) -> ArmState:
    rig = make_arm_plant(joints=joints)
    model = ControlModel.of_arm(rig.plant, rig.arm, rig.E)
    rng = np.random.default_rng(seed)
    q, v = rig.posture + rng.uniform(-0.3, 0.3, joints), rng.uniform(-1, 1, joints)
    return evaluate_arm(model, model.plant.CreateDefaultContext(), np.concatenate((q, v)))


@pytest.mark.parametrize("seed", range(5))
def test_jacobian_times_its_pseudo_inverse_is_the_identity(seed: int) -> None:
    arm = arm_state(7, seed)
    for W in (arm.B, np.eye(7), np.diag(np.arange(1.0, 8.0))):
        J_pinv = weighted_pseudo_inverse(arm.Jv_V_WE, np.linalg.inv(W))
        np.testing.assert_allclose(arm.Jv_V_WE @ J_pinv, np.eye(6), atol=1e-10)


def test_pseudo_inverse_gives_the_smallest_of_all_solutions_in_its_weight() -> None:
    arm, rng = arm_state(7, 0), np.random.default_rng(1)
    a = rng.standard_normal(6)
    J_pinv = weighted_pseudo_inverse(arm.Jv_V_WE, np.linalg.inv(arm.B))
    best = J_pinv @ a
    N = np.eye(7) - J_pinv @ arm.Jv_V_WE
    for _ in range(10):
        other = best + N @ rng.standard_normal(7)
        np.testing.assert_allclose(arm.Jv_V_WE @ other, a, atol=1e-9)
        assert other @ arm.B @ other > best @ arm.B @ best


@pytest.mark.parametrize("seed", range(5))
def test_a_wrench_causes_no_null_space_acceleration_with_the_inertia_as_weight(seed: int) -> None:
    arm = arm_state(7, seed)
    h = np.random.default_rng(seed).uniform(-20, 20, 6)
    caused = np.linalg.solve(arm.B, arm.Jv_V_WE.T @ h)

    def in_null_space(W: np.ndarray) -> float:
        J_pinv = weighted_pseudo_inverse(arm.Jv_V_WE, np.linalg.inv(W))
        return float(np.linalg.norm(caused - J_pinv @ arm.Jv_V_WE @ caused))

    assert in_null_space(arm.B) < 1e-9 * np.linalg.norm(caused)
    assert in_null_space(np.eye(7)) > 1e-3 * np.linalg.norm(caused)


def test_six_joints_give_the_same_as_the_inverse() -> None:
    arm, a = arm_state(6, 3), np.arange(1.0, 7.0)
    J_pinv = weighted_pseudo_inverse(arm.Jv_V_WE, np.linalg.inv(arm.B))
    np.testing.assert_allclose(
        J_pinv @ (a - arm.Jdot_v),
        resolved_acceleration(arm.Jv_V_WE, arm.Jdot_v, a),
        rtol=1e-8,
    )
