"""The desired motion: rest to rest, smooth, with derivatives that are derivatives."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.frame_motion import (
    ACCELERATION,
    ANGULAR_VELOCITY,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
    VELOCITY,
    frame_motion_at_rest,
    pose_of,
)
from geoimp_drake.systems.sources.desired_motion import DesiredMotion, MotionSegment

START = RigidTransform(RollPitchYaw(2.0, 0.4, -1.0), [0.9, 0.1, 0.7])
LINE = np.array([0.05, -0.1, -0.24])
TURN = np.array([0.4, -1.1, 2.3])  # more than half a turn lies behind both turns together
SEGMENTS = [
    MotionSegment(3.0, displacement=LINE, name="line"),
    MotionSegment(1.5),
    MotionSegment(2.0, rotation=TURN, name="turn"),
    MotionSegment(2.5, displacement=-LINE, rotation=TURN[::-1]),
]
ENDS = [3.0, 4.5, 6.5, 9.0]
STEP = 1e-5


def moving_times() -> np.ndarray:
    """Returns times inside the segments that move, away from their ends."""
    return np.concatenate(
        [np.linspace(a + 0.01, b - 0.01, 40) for a, b in [(0, 3), (4.5, 6.5), (6.5, 9)]]
    )


def test_poses_at_the_ends_of_the_segments_are_those_asked_for() -> None:
    motion = DesiredMotion(START, SEGMENTS)
    R = START.rotation().matrix()
    R1 = quaternion.to_rotation(quaternion.exp(TURN)) @ R
    R2 = quaternion.to_rotation(quaternion.exp(TURN[::-1])) @ R1
    p = START.translation()
    expected = [(p + LINE, R), (p + LINE, R), (p + LINE, R1), (p, R2)]
    for time, (p_WD, R_WD) in zip(ENDS, expected, strict=True):
        X = pose_of(motion.evaluate(time))
        np.testing.assert_allclose(X.translation(), p_WD, atol=1e-12)
        np.testing.assert_allclose(X.rotation().matrix(), R_WD, atol=1e-12)
    assert motion.duration() == 9.0


@pytest.mark.parametrize("time", [0.0, *ENDS])
def test_every_segment_starts_and_ends_at_rest(time: float) -> None:
    motion = DesiredMotion(START, SEGMENTS)
    np.testing.assert_allclose(motion.evaluate(time)[VELOCITY], np.zeros(6), atol=1e-12)
    np.testing.assert_allclose(motion.evaluate(time)[ACCELERATION], np.zeros(6), atol=1e-11)


def test_velocities_are_the_derivatives_of_the_pose() -> None:
    motion = DesiredMotion(START, SEGMENTS)
    speeds = []
    for t in moving_times():
        before, now, after = (motion.evaluate(t + s * STEP) for s in (-1, 0, 1))
        v = (after[POSITION] - before[POSITION]) / (2 * STEP)
        turn = quaternion.relative(
            quaternion.conjugate(after[QUATERNION]), quaternion.conjugate(before[QUATERNION])
        )
        w = quaternion.log(turn) / (2 * STEP)
        np.testing.assert_allclose(now[LINEAR_VELOCITY], v, atol=1e-7)
        np.testing.assert_allclose(now[ANGULAR_VELOCITY], w, atol=1e-6)
        speeds.append(np.abs(now[VELOCITY]).max())
    assert max(speeds) > 1.0


def test_accelerations_are_the_derivatives_of_the_velocities() -> None:
    motion = DesiredMotion(START, SEGMENTS)
    for t in moving_times():
        before, now, after = (motion.evaluate(t + s * STEP) for s in (-1, 0, 1))
        expected = (after[VELOCITY] - before[VELOCITY]) / (2 * STEP)
        np.testing.assert_allclose(now[ACCELERATION], expected, atol=1e-6)


def test_motion_and_its_derivatives_have_no_steps() -> None:
    motion = DesiredMotion(START, SEGMENTS)
    times = np.arange(-0.5, 9.5, 1e-3)
    rows = np.array([motion.evaluate(t) for t in times])
    jumps = np.abs(np.diff(rows, axis=0)).max(axis=0)
    # The largest jerk is 60 displacement / duration³: 20 rad/s³.
    assert jumps[ACCELERATION].max() < 25.0 * 1e-3
    assert jumps[VELOCITY].max() < 5.0 * 1e-3
    assert jumps[:7].max() < 3.0 * 1e-3  # Q does not change its sign either


def test_path_is_the_quintic_from_rest_to_rest() -> None:
    motion = DesiredMotion(START, SEGMENTS)
    for tau in np.linspace(0.0, 1.0, 11):
        s = 10 * tau**3 - 15 * tau**4 + 6 * tau**5
        np.testing.assert_allclose(
            motion.evaluate(3.0 * tau)[POSITION], START.translation() + s * LINE, atol=1e-12
        )
        turned = quaternion.product(quaternion.exp(s * TURN), motion.evaluate(4.5)[QUATERNION])
        np.testing.assert_allclose(motion.evaluate(4.5 + 2 * tau)[QUATERNION], turned, atol=1e-12)


def test_D_rests_before_the_start_after_the_end_and_during_a_rest() -> None:
    motion = DesiredMotion(START, SEGMENTS)
    np.testing.assert_array_equal(motion.evaluate(-1.0), motion.evaluate(0.0))
    np.testing.assert_array_equal(motion.evaluate(50.0), motion.evaluate(9.0))
    for t in (3.2, 4.0, 4.4):
        np.testing.assert_allclose(motion.evaluate(t), motion.evaluate(3.0), atol=1e-12)


def test_without_segments_D_rests_at_its_start() -> None:
    motion = DesiredMotion(START)
    for t in (0.0, 3.0):
        np.testing.assert_array_equal(motion.evaluate(t), frame_motion_at_rest(START))
    assert motion.duration() == 0.0


def test_port_gives_what_evaluate_gives() -> None:
    motion = DesiredMotion(START, SEGMENTS)
    context = motion.CreateDefaultContext()
    for t in (1.0, 5.3, 8.0):
        context.SetTime(t)
        np.testing.assert_array_equal(motion.get_output_port().Eval(context), motion.evaluate(t))


@pytest.mark.parametrize(
    ("segment", "message"),
    [
        (MotionSegment(0.0), r"segments.1.duration is 0 s"),
        (MotionSegment(-2.0), r"duration is -2 s"),
        (MotionSegment(np.nan), r"duration is nan;"),
        (MotionSegment(np.inf), r"duration is inf;"),
        (
            MotionSegment(1.0, displacement=np.array([0, np.nan, 0])),
            r"segments.1.displacement.*nan",
        ),
        (MotionSegment(1.0, displacement=np.zeros(2)), r"displacement.*3 finite"),
        (MotionSegment(1.0, rotation=np.array([0, np.inf, 0])), r"rotation.*inf"),
        (MotionSegment(1.0, rotation=np.array(1.0)), r"rotation.*3 finite"),
    ],
)
def test_a_segment_that_cannot_be_is_refused_with_its_number(segment, message) -> None:
    with pytest.raises(ConfigurationError, match=message):
        DesiredMotion(START, [MotionSegment(1.0), segment])
