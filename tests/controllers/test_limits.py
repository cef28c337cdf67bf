"""An arm at its limits: E stays on C, joints stay inside; and where no limit acts."""

import logging
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from limited_arm import POSTURES, Driven, arm_plant, drive, outward, pose_at, pushed, there_and_back
from pydrake.math import RigidTransform
from pydrake.multibody.tree import JacobianWrtVariable
from two_arms import make_controlled_pair

from geoimp_drake.compilation.compiled import is_available
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.cooperative_config import CooperativeControllerConfig
from geoimp_drake.parts import quadratic_program
from geoimp_drake.parts.joint_limits import SLACK, LimitsConfig
from geoimp_drake.systems.frame_motion import frame_motion_at_rest, pose_of

pytestmark = pytest.mark.skipif(not is_available(), reason="numba is not installed")

NONE = np.zeros(3)
WRIST_STRAIGHT = POSTURES[6] * [1, 1, 1, 0, 0, 1]
Runs = Callable[[ImpedanceControllerConfig], Driven]


def config(form: str = "compiled", damping: float = 2000.0, **limits) -> ImpedanceControllerConfig:
    made = ImpedanceControllerConfig(form=form, limits=LimitsConfig(**limits))
    made.impedance.translation.damping = np.array(damping)
    made.impedance.rotation.stiffness = np.array(20.0)
    return made


def case(joints=6, q=None, shift=NONE, turn=NONE, duration=1.0, back=2.0, end=3.5, **plant) -> Runs:
    """Returns how D goes there and back; a shift is outward, sideways and up."""
    q = POSTURES[joints] if q is None else q

    def run(made: ImpedanceControllerConfig) -> Driven:
        arm = arm_plant(joints, **plant)
        X = pose_at(arm, q)
        out = outward(X)
        R = np.column_stack((out, np.cross([0, 0, 1], out), [0, 0, 1]))
        desired = there_and_back(X, R @ shift, R @ turn, duration, back)
        return drive(arm, made, q, end, desired)

    return run


def push(force: float, until: float, end: float, stiffness=700.0, damping=200.0, turn=0) -> Runs:
    """Returns how the world pushes E outward, or turned from there by a number of right angles."""

    def run(made: ImpedanceControllerConfig) -> Driven:
        arm, q = arm_plant(), POSTURES[6]
        gains = made.impedance.translation
        gains.damping, gains.stiffness = np.array(damping), np.array(stiffness)
        direction = outward(pose_at(arm, q))
        if turn:
            direction = np.cross([0, 0, 1], direction)
        return drive(arm, made, q, end, push=pushed(force * direction, until, 0.02))

    return run


# What happens, and what then acts.
CASES: dict[str, tuple[Runs, str]] = {
    "elbow pushed straight": (push(450.0, 1.5, 3.5), "effort"),
    "D beyond reach": (case(shift=[1.0, 0, 0], duration=1.5, back=2.5, end=4.5), "singularity"),
    "joint stop": (case(turn=[0, 1.8, 0], end=4.0), "position"),
    "start at a wrist singularity": (case(q=WRIST_STRAIGHT, shift=[-0.1, 0.1, 0.1]), "singularity"),
    "little effort": (case(shift=[0, 0.7, 0.3], duration=0.6, back=1.5, effort=0.4), "effort"),
    "push": (push(200.0, 0.6, 4.0, 200.0, 40.0, turn=1), "velocity"),
    "beyond the track": (case(7, shift=[0, 3.0, 0], duration=2, back=4, end=7.5), "position"),
}
ACTS = ("position", "velocity", "effort", "singularity")


@cache
def run(name: str, form: str = "compiled") -> Driven:
    runs, _ = CASES[name]
    return runs(config(form))


@pytest.mark.parametrize("name", CASES)
def test_at_a_limit_E_stays_on_C_and_the_joints_inside(name: str) -> None:
    driven, acts = run(name), CASES[name][1]
    assert driven.limited[:, ACTS.index(acts)].any()
    assert driven.distance().max() < 6e-3
    assert driven.angle().max() < 1.0
    assert driven.effort() <= 1.0
    assert driven.speed() <= 0.97
    assert driven.stays_inside()
    assert driven.distance()[-1] < 1e-4


def test_without_limits_E_leaves_C() -> None:
    made = config()
    made.limits = None
    driven = CASES["elbow pushed straight"][0](made)
    assert driven.distance().max() > 0.1
    assert driven.effort() > 5.0
    assert not driven.stays_inside()


def test_both_forms_do_the_same_at_a_limit() -> None:
    compiled, blocks = run("little effort"), run("little effort", "blocks")
    np.testing.assert_allclose(blocks.q, compiled.q, atol=1e-9)
    np.testing.assert_allclose(blocks.limited, compiled.limited, atol=1e-5)


def test_where_nothing_binds_limits_change_nothing() -> None:
    gentle = case(shift=[0.05, 0.1, -0.05], duration=0.5, back=0.6, end=0.8)
    kept, free = config(), config()
    free.limits = None
    ours, others = gentle(kept), gentle(free)
    assert not ours.limited.any()
    for name in ("q", "v", "u", "C"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(others, name))


def test_free_directions_keep_their_law() -> None:
    assert_slack_is_by_the_joint_at_its_end(run("joint stop"), np.diag([9.0, 9.0, 9.0]))


def test_they_keep_it_with_masses_in_axes_that_turn() -> None:
    made, M_p = config(), np.diag([3.0, 9.0, 27.0])
    made.impedance.translation.mass, made.impedance.translation.axes = M_p, "desired"
    assert_slack_is_by_the_joint_at_its_end(CASES["joint stop"][0](made), M_p)


def assert_slack_is_by_the_joint_at_its_end(driven: Driven, M_p: np.ndarray) -> None:
    """Beyond the reach of one direction, C's law is that of the impedance in the others.

    What it lacks there is J⁻ᵀ of the torques by which the joints are held, by W = M in E.
    """
    slack = driven.limited[:, SLACK]
    acting = np.flatnonzero(driven.limited[:, 0] == 1)
    assert len(acting) > 20
    context = driven.plant.CreateDefaultContext()
    E, W = driven.plant.GetFrameByName("flange"), driven.plant.world_frame()
    for k in acting[::10]:
        if driven.limited[k, 1:4].any():
            continue
        driven.plant.SetPositions(context, driven.q[k])
        R = E.CalcPoseInWorld(context).rotation().matrix()
        J = driven.plant.CalcJacobianSpatialVelocity(context, JacobianWrtVariable.kV, E, NONE, W, W)
        force = np.concatenate((0.4 * slack[k, :3], R @ M_p @ R.T @ slack[k, 3:]))
        assert np.sort(np.abs(J.T @ force))[-2] < 0.3


def test_it_works_as_well_without_daqp(monkeypatch) -> None:
    monkeypatch.setattr(quadratic_program, "_solver", lambda: quadratic_program._by_clarabel)
    driven = CASES["little effort"][0](config())
    np.testing.assert_allclose(driven.q, run("little effort").q, atol=1e-6)


def test_a_singular_posture_is_said_once(caplog) -> None:
    with caplog.at_level(logging.WARNING, logger="drake"):
        CASES["start at a wrist singularity"][0](config())
    (said,) = [text for text in caplog.messages if "singularity" in text]
    assert "smallest_singular_value is below 0.01" in said


def beyond_reach_of_two(form: str, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns errors of the hands (N, 2) [m, rad] and `Limited` of both arms (N, 2, 10)."""
    still = frame_motion_at_rest(RigidTransform())
    X = pose_of(make_controlled_pair(lambda t: still).read("object_motion"))
    made = CooperativeControllerConfig(form=form)
    made.impedance.translation.damping = np.array(400.0)
    pair = make_controlled_pair(there_and_back(X, [0, 1.2, 0], NONE, 1.0, 1.5), made)
    errors, limited = [], []

    def look(root) -> None:
        errors.append(pair.tracking_error())
        limited.append([pair.read(f"limited_{k}") for k in (1, 2)])

    pair.simulator.set_monitor(look)
    pair.simulator.AdvanceTo(duration)
    return np.array(errors), np.array(limited)


def test_hands_of_two_arms_stay_near_their_references() -> None:
    errors, limited = beyond_reach_of_two("compiled", 2.6)
    distance, angle = errors.max(axis=0)
    assert limited[:, :, :4].any(axis=(0, 2)).all()
    assert distance < 0.015  # 1.2 m without limits
    assert np.degrees(angle) < 5.0
    assert errors[-1, 0] < 1e-4


def test_both_forms_of_a_cooperation_do_the_same_at_a_limit() -> None:
    runs = [beyond_reach_of_two(form, 0.52) for form in ("compiled", "blocks")]
    (errors, limited), (others, reports) = runs
    assert limited[:, :, :4].any(axis=(0, 2)).all()
    np.testing.assert_allclose(others, errors, atol=1e-8)
    np.testing.assert_allclose(reports, limited, atol=1e-4)
