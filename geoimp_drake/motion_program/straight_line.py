"""Joint paths that move the tool frame along a straight line, by inverse kinematics."""

import math

import numpy as np
from pydrake.math import RigidTransform
from pydrake.trajectories import PiecewisePolynomial, PiecewisePose

from geoimp_drake.errors import ConfigurationError, SingularityError
from geoimp_drake.motion_program.postures import ArmPostures
from geoimp_drake.typing import Array

__all__ = ["pose_distance", "straight_path"]

# Largest distance of two knots; it is halved until the path is exact enough, or this often.
_KNOT_DISTANCE = 0.01  # [m]
_KNOT_ANGLE = 0.04  # [rad]
_FEWEST_INTERVALS = 4
_MOST_INTERVALS = 10_000
_HALVINGS = 3
# Largest error of the tool frame along the line.
_POSITION_TOLERANCE = 2e-5  # [m]
_ATTITUDE_TOLERANCE = 5e-5  # [rad]


def pose_distance(X_WA: RigidTransform, X_WB: RigidTransform) -> tuple[float, float]:
    """Returns the distance of the origins of A and B [m] and the angle from A to B [rad]."""
    distance = float(np.linalg.norm(X_WB.translation() - X_WA.translation()))
    R_AB = (X_WA.rotation().inverse() @ X_WB.rotation()).ToAngleAxis()
    return distance, float(abs(R_AB.angle()))


def straight_path(
    arm: ArmPostures, q_start: Array, X_WT: RigidTransform, label: str
) -> PiecewisePolynomial:
    """Returns the joint positions (n) over the path parameter s from 0 to 1.

    The origin of T runs along a straight line, its attitude about one fixed axis (slerp), both in
    proportion to s. At each knot along the line the posture is the one nearest to that of the knot
    before. A cubic spline with continuous second derivatives joins the postures.

    Args:
        arm: the arm, T its tool frame.
        q_start: posture at s = 0 (n) [rad or m].
        X_WT: pose of T at s = 1.
        label: names the move in errors.

    Raises:
        ConfigurationError: a pose on the line is out of reach or beyond a joint's limit.
        SingularityError: the joints turn so fast along the line that they leave it.
    """
    line = PiecewisePose.MakeLinear([0.0, 1.0], [arm.tool_pose(q_start), X_WT])
    distance, angle = pose_distance(line.GetPose(0.0), X_WT)
    intervals = max(
        _FEWEST_INTERVALS, math.ceil(distance / _KNOT_DISTANCE), math.ceil(angle / _KNOT_ANGLE)
    )
    if intervals > _MOST_INTERVALS:
        raise ConfigurationError(
            f"{label}: the line is {distance:.4g} m long, {intervals:.3g} times {_KNOT_DISTANCE:g} "
            f"m; at most {_MOST_INTERVALS} are computed. Teach a pose within reach."
        )
    for halving in range(_HALVINGS + 1):
        knots = np.linspace(0.0, 1.0, intervals * 2**halving + 1)
        path = _spline(arm, line, q_start, knots, f"{label} ({distance:.4g} m, {angle:.4g} rad)")
        s, off_line, off_attitude = _worst_deviation(arm, line, path, knots)
        if off_line < _POSITION_TOLERANCE and off_attitude < _ATTITUDE_TOLERANCE:
            return path
    raise SingularityError(
        f"{label}: the arm passes a singularity about {s:.0%} of the way: it leaves the line by "
        f"{off_line * 1e3:.3g} mm and {off_attitude:.3g} rad. Teach another posture or pose."
    )


def _spline(
    arm: ArmPostures, line: PiecewisePose, q_start: Array, knots: Array, label: str
) -> PiecewisePolynomial:
    """Returns the spline through the postures at the knots."""
    postures = [q_start]
    for s in knots[1:]:
        X_WT = line.GetPose(s)
        q = arm.nearest(X_WT, postures[-1])
        if q is None:
            raise _no_posture(arm, X_WT, postures[-1], f"{label}, {s:.0%} of the way")
        postures.append(q)
    samples = np.column_stack(postures)
    return PiecewisePolynomial.CubicWithContinuousSecondDerivatives(knots, samples, False)


def _no_posture(
    arm: ArmPostures, X_WT: RigidTransform, q_near: Array, where: str
) -> ConfigurationError:
    """Returns the error for a pose that has no posture: limits or reach."""
    beyond = arm.nearest(X_WT, q_near, within_limits=False)
    if beyond is not None and (outside := arm.outside_limits(beyond)):
        return ConfigurationError(f"{where}: beyond the joint limits: {outside}.")
    position = np.round(X_WT.translation(), 4).tolist()
    return ConfigurationError(
        f"{where}: no posture near the one before puts the tool frame at {position} with that "
        f"attitude. Teach a pose within reach or start from another posture."
    )


def _worst_deviation(
    arm: ArmPostures, line: PiecewisePose, path: PiecewisePolynomial, knots: Array
) -> tuple[float, float, float]:
    """Returns s where T is farthest from the line, how far [m], and the largest turn [rad].

    It searches the knots and the points half-way between them, where a cubic strays most.
    """
    places = np.concatenate((knots, 0.5 * (knots[1:] + knots[:-1])))
    deviations = np.array(
        [pose_distance(line.GetPose(s), arm.tool_pose(path.value(s)[:, 0])) for s in places]
    )
    worst = np.argmax((deviations / (_POSITION_TOLERANCE, _ATTITUDE_TOLERANCE)).max(axis=1))
    off_line, off_attitude = deviations.max(axis=0)
    return float(places[worst]), float(off_line), float(off_attitude)
