"""The limits of an arm keep its efforts whatever is asked of it, in whatever state."""

import numpy as np
import pytest
from limited_arm import arm_plant

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.state import evaluate_arm
from geoimp_drake.parts import quadratic_program
from geoimp_drake.parts.joint_limits import SLACK, JointLimits, LimitsConfig


@pytest.mark.parametrize("joints", [6, 7])
def test_a_thousand_random_demands_have_accelerations_within_the_efforts(joints: int) -> None:
    rng = np.random.default_rng(joints)
    plant = arm_plant(joints)
    E = plant.GetFrameByName("flange")
    model = ControlModel.of_arm(plant, E.model_instance(), E)
    kept = JointLimits(model, LimitsConfig())
    scratch, acted = model.plant.CreateDefaultContext(), np.zeros(4)
    (low, high), speed = model.position_limits, model.velocity_limits[1]
    for _ in range(1000):
        # Also a little beyond the positions and the velocities, and some joints exactly at zero.
        q = np.clip(rng.uniform(1.02 * low, 1.02 * high), -4, 4) * (rng.random(joints) > 0.1)
        v = 1.2 * speed * rng.uniform(-1, 1, joints)
        arm = evaluate_arm(model, scratch, np.concatenate((q, v)))
        a = 10 ** rng.uniform(-1, 4) * rng.normal(size=6)
        h = 10 ** rng.uniform(-1, 3) * rng.normal(size=6)
        alpha_0 = np.linalg.lstsq(arm.Jv_V_WE, a - arm.Jdot_v, rcond=0.01)[0]
        alpha, limited = kept.constrained(arm, h, a, alpha_0)
        tau = arm.B @ alpha + arm.Cv + arm.Fv + arm.g + arm.Jv_V_WE.T @ h
        assert (np.abs(tau) <= model.effort_limits).all()
        slack = arm.Jv_V_WE @ alpha + arm.Jdot_v - a
        np.testing.assert_allclose(limited[SLACK], slack, rtol=1e-9, atol=1e-9)
        acted += limited[:4] > 0
    assert (acted > 10).all()


def test_without_daqp_clarabel_finds_the_same() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        A = rng.normal(size=(6, 6))
        problem = A @ A.T + np.eye(6), 10 * rng.normal(size=6), A + 3 * np.eye(6)
        bounds = np.concatenate((np.full(6, -0.5), np.full(6, -np.inf)))
        bounds[7] = -0.1
        found = [
            solve(*problem, np.clip(bounds, -1e30, 1e30), np.clip(-bounds, -1e30, 1e30))
            for solve in (quadratic_program._by_daqp, quadratic_program._by_clarabel)
        ]
        np.testing.assert_allclose(found[1], found[0], atol=1e-4)
