"""Any trajectory of Drake's as a desired motion: its derivatives, and rest outside its time."""

from itertools import pairwise

import numpy as np
import pytest
from pydrake.math import BsplineBasis, KnotVectorType, RigidTransform, RollPitchYaw
from pydrake.trajectories import (
    BsplineTrajectory,
    DiscreteTimeTrajectory,
    PiecewisePolynomial,
    PiecewisePose,
    PiecewiseQuaternionSlerp,
)

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.frame_motion import (
    ACCELERATION,
    POSITION,
    QUATERNION,
    VELOCITY,
    pose_of,
)
from geoimp_drake.systems.sources.desired_motion import DesiredMotion

TIMES = [0.5, 1.4, 2.0, 3.5]
POSES = [
    RigidTransform(RollPitchYaw(2.0, 0.4, -1.0), [0.9, 0.1, 0.7]),
    RigidTransform(RollPitchYaw(1.0, 0.9, -1.2), [0.8, 0.3, 0.6]),
    RigidTransform(RollPitchYaw(-0.5, 0.2, 1.0), [0.7, 0.1, 0.9]),
    RigidTransform(RollPitchYaw(-1.5, -0.8, 2.0), [0.9, -0.2, 0.7]),
]
POINTS = np.array([X.translation() for X in POSES]).T
ZERO = np.zeros(3)
LINE = PiecewisePolynomial.CubicWithContinuousSecondDerivatives(TIMES, POINTS, ZERO, ZERO)
QUATERNIONS = [X.rotation().ToQuaternion().wxyz() for X in POSES]
for k in range(1, 4):  # the nearer of Q and −Q, and of another norm
    QUATERNIONS[k] = QUATERNIONS[k] * (1.0 + k) * np.sign(QUATERNIONS[k] @ QUATERNIONS[k - 1])
TURN = PiecewisePolynomial.CubicWithContinuousSecondDerivatives(
    TIMES, np.array(QUATERNIONS).T, np.zeros(4), np.zeros(4)
)
SLERP = PiecewiseQuaternionSlerp(TIMES, [X.rotation() for X in POSES])
# From rest to rest: the first three and the last three points are the same.
BASIS = BsplineBasis(4, 9, KnotVectorType.kClampedUniform, 0.5, 3.5)
SPLINE = BsplineTrajectory(
    BASIS, [X.translation().reshape(3, 1) for X in np.repeat(POSES, [3, 2, 1, 3])]
)
MOTIONS = {
    "pose": DesiredMotion.along(
        PiecewisePose.MakeCubicLinearWithEndLinearVelocity(TIMES, POSES, ZERO, ZERO)
    ),
    "position and slerp": DesiredMotion.along(LINE, SLERP),
    "position and quaternion": DesiredMotion.along(LINE, TURN),
    "spline and attitude": DesiredMotion.along(SPLINE, POSES[0].rotation()),
}
every_motion = pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)


def inside() -> np.ndarray:
    return np.concatenate([np.linspace(a + 0.01, b - 0.01, 9) for a, b in pairwise(TIMES)])


@every_motion
def test_velocity_and_acceleration_are_derivatives(motion) -> None:
    h = 1e-5
    for t in inside():
        before, now, after = (motion.evaluate(t + s) for s in (-h, 0.0, h))
        v = (after[POSITION] - before[POSITION]) / (2 * h)
        turn = quaternion.product(after[QUATERNION], quaternion.conjugate(before[QUATERNION]))
        w = quaternion.log(turn) / (2 * h)
        np.testing.assert_allclose(now[VELOCITY], [*w, *v], atol=1e-8)
        a = (after[VELOCITY] - before[VELOCITY]) / (2 * h)
        np.testing.assert_allclose(now[ACCELERATION], a, atol=1e-7)


@every_motion
def test_outside_its_time_it_rests_where_it_begins_and_ends(motion) -> None:
    for time, X in ((0.0, POSES[0]), (0.499, POSES[0]), (3.5, POSES[-1]), (9.0, POSES[-1])):
        at = motion.evaluate(time)
        np.testing.assert_array_equal(at[VELOCITY], np.zeros(6))
        np.testing.assert_array_equal(at[ACCELERATION], np.zeros(6))
        np.testing.assert_allclose(at[POSITION], X.translation(), atol=1e-12)
        assert abs(np.linalg.norm(at[QUATERNION]) - 1.0) < 1e-12
    assert motion.duration() == 3.5


@pytest.mark.parametrize("name", ["pose", "position and slerp", "position and quaternion"])
def test_it_passes_the_poses_at_their_times(name) -> None:
    for time, X in zip(TIMES, POSES, strict=True):
        assert pose_of(MOTIONS[name].evaluate(time)).IsNearlyEqualTo(X, 1e-9)


def test_the_port_says_what_evaluate_does_and_the_trajectory_may_change_later() -> None:
    line = PiecewisePolynomial.FirstOrderHold(TIMES, POINTS)
    motion = DesiredMotion.along(line, POSES[0].rotation())
    before = motion.evaluate(2.5)
    line.shiftRight(1.0)
    context = motion.CreateDefaultContext()
    context.SetTime(2.5)
    np.testing.assert_array_equal(motion.GetOutputPort("motion").Eval(context), before)


def test_a_velocity_that_jumps_at_an_end_is_told_of(caplog) -> None:
    DesiredMotion.along(LINE, POSES[0].rotation())
    assert not caplog.records
    DesiredMotion.along(LINE, SLERP)
    begins, ends = (record.getMessage() for record in caplog.records)
    assert "begins at t = 0.5 s with 0 m/s and 1." in begins
    assert "ends at t = 3.5 s" in ends


SHIFTED = PiecewiseQuaternionSlerp([t + 1.0 for t in TIMES], [X.rotation() for X in POSES])
REFUSED = {
    "size": (lambda: DesiredMotion.along(TURN, SLERP), r"position has values of 4×1; give 3"),
    "rotation's size": (lambda: DesiredMotion.along(LINE, LINE), r"rotation has .* 3×1; give 4"),
    "no rotation": (lambda: DesiredMotion.along(LINE), r"needs a rotation"),
    "two rotations": (
        lambda: DesiredMotion.along(PiecewisePose.MakeLinear(TIMES, POSES), SLERP),
        r"has its own rotation",
    ),
    "times": (
        lambda: DesiredMotion.along(LINE, SHIFTED),
        r"from t = 0.5 to 3.5 s and its rotation from 1.5 to 4.5 s",
    ),
    "derivatives": (
        lambda: DesiredMotion.along(DiscreteTimeTrajectory(TIMES, list(POINTS.T)), SLERP),
        r"DiscreteTimeTrajectory, has no derivatives",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_followed_is_refused(case) -> None:
    make, message = REFUSED[case]
    with pytest.raises(ConfigurationError, match=message):
        make()
