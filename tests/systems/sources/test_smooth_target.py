"""A live target: arrives, smoothly, whatever it does on the way."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig

from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.frame_motion import (
    ACCELERATION,
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
    VELOCITY,
    pose_of,
)
from geoimp_drake.systems.sources.smooth_target import SmoothTarget

START = RigidTransform([0.5, 0.1, 0.7])
STEP = 2e-3
POLE = 8.4059  # for a settling time of one second [1/s]


def random_target(rng: np.random.Generator) -> RigidTransform:
    Q = quaternion.normalized(rng.standard_normal(4))
    R = RotationMatrix.ProjectToRotationMatrix(quaternion.to_rotation(Q))
    return RigidTransform(R, rng.uniform(-1.0, 1.0, 3))


def moved(
    targets: list[tuple[float, RigidTransform]], end: float, **options
) -> tuple[np.ndarray, np.ndarray]:
    """Returns times and motions of D (N, 19); each target holds from its time on."""
    system = SmoothTarget(START, **options)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    config = SimulatorConfig(
        integration_scheme="runge_kutta3", max_step_size=STEP, use_error_control=False
    )
    ApplySimulatorConfig(config, simulator)
    times, rows, waiting = np.arange(round(end / STEP) + 1) * STEP, [], list(targets)
    for t in times:
        simulator.AdvanceTo(t)
        if waiting and t >= waiting[0][0] - 1e-9:
            system.GetInputPort("target").FixValue(context, waiting.pop(0)[1])
        rows.append(system.GetOutputPort("motion").Eval(context).copy())
    return times, np.array(rows)


def test_a_step_has_the_shape_of_three_equal_poles_along_a_line_and_about_an_axis() -> None:
    axis, way = np.array([0.36, -0.48, 0.8]), np.array([0.1, 0.2, -0.2])
    turn = RotationMatrix.ProjectToRotationMatrix(
        quaternion.to_rotation(quaternion.from_axis_angle(axis, 3.0))
    )
    target = RigidTransform(turn, START.translation() + way)
    times, motion = moved([(0.0, target)], 2.0, settling=1.5)
    x = POLE / 1.5 * times
    share = 1.0 - (1.0 + x + 0.5 * x**2) * np.exp(-x)
    np.testing.assert_allclose(
        motion[:, POSITION] - START.translation(), np.outer(share, way), atol=1e-5
    )
    angles = np.array([quaternion.log(Q) for Q in motion[:, QUATERNION]])
    np.testing.assert_allclose(angles, 3.0 * np.outer(share, axis), atol=1e-4)
    assert share[750] == pytest.approx(0.99, abs=1e-5)


SEEDS = range(4)


@pytest.mark.parametrize("seed", SEEDS)
def test_targets_in_mid_motion_leave_velocity_and_acceleration_continuous(seed: int) -> None:
    rng = np.random.default_rng(seed)
    targets = [(t, random_target(rng)) for t in (0.0, 0.2, 0.25, 0.5, 0.9)]
    _, motion = moved(targets, 4.0)
    # The law's own bounds on the acceleration and on its rate, with room for the step.
    for velocity, acceleration, error in (
        (LINEAR_VELOCITY, LINEAR_ACCELERATION, 2.0 * np.sqrt(3.0)),
        (ANGULAR_VELOCITY, ANGULAR_ACCELERATION, np.pi),
    ):
        v, a = motion[:, velocity], motion[:, acceleration]
        fastest, most = np.linalg.norm(v, axis=1).max(), np.linalg.norm(a, axis=1).max()
        jerk = POLE**3 * error + 3.0 * POLE**2 * fastest + 3.0 * POLE * most
        assert np.linalg.norm(np.diff(v, axis=0), axis=1).max() < 1.05 * STEP * most
        assert np.linalg.norm(np.diff(a, axis=0), axis=1).max() < 1.05 * STEP * jerk
        assert most < POLE**2 * error  # a step from rest: 0.23 of it
    assert pose_of(motion[-1]).IsNearlyEqualTo(targets[-1][1], 1e-5)
    np.testing.assert_allclose(motion[-1, VELOCITY], np.zeros(6), atol=1e-4)


@pytest.mark.parametrize("seed", SEEDS)
def test_velocities_and_accelerations_are_derivatives(seed: int) -> None:
    rng = np.random.default_rng(seed)
    _, motion = moved([(t, random_target(rng)) for t in (0.0, 0.3, 0.6)], 1.5)
    middle, h = motion[1:-1], 2.0 * STEP
    v = (motion[2:, POSITION] - motion[:-2, POSITION]) / h
    turns = [
        quaternion.product(after, quaternion.conjugate(before))
        for before, after in zip(motion[:-2, QUATERNION], motion[2:, QUATERNION], strict=True)
    ]
    w = np.array([quaternion.log(turn) for turn in turns]) / h
    a = (motion[2:, VELOCITY] - motion[:-2, VELOCITY]) / h
    np.testing.assert_allclose(middle[:, LINEAR_VELOCITY], v, atol=1e-3)
    np.testing.assert_allclose(middle[:, ANGULAR_VELOCITY], w, atol=1e-2)
    np.testing.assert_allclose(middle[:, ACCELERATION], a, atol=3.0)


@pytest.mark.parametrize("angle", [np.pi, np.pi - 1e-6, 2.0])
def test_the_rotation_takes_the_shorter_way_up_to_half_a_turn(angle: float) -> None:
    target = RigidTransform(RotationMatrix.MakeYRotation(angle), START.translation())
    _, motion = moved([(0.0, target)], 3.0)
    speeds = np.linalg.norm(motion[:, ANGULAR_VELOCITY], axis=1)
    assert STEP * speeds.sum() == pytest.approx(angle, rel=1e-4)
    assert pose_of(motion[-1]).IsNearlyEqualTo(target, 1e-5)


def test_speeds_are_kept_to_and_the_target_is_reached() -> None:
    target = RigidTransform(RotationMatrix.MakeXRotation(3.0), [0.5, 1.1, 0.7])
    _, motion = moved([(0.0, target)], 8.0, settling=0.5, speed=0.25, angular_speed=0.8)
    for part, limit in ((LINEAR_VELOCITY, 0.25), (ANGULAR_VELOCITY, 0.8)):
        fastest = np.linalg.norm(motion[:, part], axis=1).max()
        assert limit * 0.999 < fastest < limit * 1.005
    assert pose_of(motion[-1]).IsNearlyEqualTo(target, 1e-5)
    peak = np.abs(motion[:, LINEAR_ACCELERATION]).max()
    assert peak < 0.25 * POLE / 0.5


def test_d_stays_where_the_target_is() -> None:
    _, motion = moved([(0.0, START)], 0.5)
    np.testing.assert_allclose(motion, np.tile(motion[0], (len(motion), 1)), atol=1e-15)


def test_numbers_that_cannot_be_used_are_refused() -> None:
    for options, message in (
        ({"settling": 0.0}, "settling is 0 s"),
        ({"speed": -1.0}, "speed is -1"),
        ({"angular_speed": np.nan}, "angular_speed is nan"),
    ):
        with pytest.raises(ConfigurationError, match=message):
            SmoothTarget(START, **options)
    with pytest.raises(SignalError, match=r"target.*nan"):
        moved([(0.0, RigidTransform([np.nan, 0.0, 0.0]))], 0.1)
