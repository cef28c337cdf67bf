"""A motion of D along a trajectory of Drake's: position and rotation with their derivatives."""

import logging

import numpy as np
from pydrake.math import RotationMatrix
from pydrake.trajectories import PiecewisePose, PiecewiseQuaternionSlerp, Trajectory

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.frame_motion import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSE_SIZE,
    POSITION,
    QUATERNION,
)
from geoimp_drake.typing import Array

__all__ = ["TrajectoryOfD"]

_log = logging.getLogger("drake")

# Below this a frame counts as at rest [m/s, rad/s].
_AT_REST = 1e-6


class TrajectoryOfD:
    """Follows a trajectory during its time, and rests before and after; see `DesiredMotion.along`.

    Attributes:
        end: of the trajectory [s].
    """

    def __init__(self, trajectory: Trajectory, rotation: Trajectory | RotationMatrix | None):
        if isinstance(trajectory, PiecewisePose):
            if rotation is not None:
                raise ConfigurationError("A PiecewisePose has its own rotation; leave it out.")
            rotation = trajectory.get_orientation_trajectory()
            trajectory = trajectory.get_position_trajectory()
        if rotation is None:
            raise ConfigurationError(
                "A trajectory of D's position needs a rotation: a PiecewiseQuaternionSlerp, a "
                "trajectory of a quaternion, or a RotationMatrix."
            )
        if isinstance(rotation, RotationMatrix):
            rotation = _constant(rotation, trajectory)
        self._position = _usable(trajectory, 3, "position")
        self._rotation = rotation.Clone()
        if not isinstance(rotation, PiecewiseQuaternionSlerp):
            _usable(rotation, 4, "rotation")
        self._start, self.end = _span(self._position, self._rotation)
        self._warn_of_jumps()

    def write(self, time: float, motion: Array) -> None:
        """Writes the motion of D at a time [s]."""
        within = self._start <= time < self.end
        self._write_along(min(max(time, self._start), self.end), motion)
        if not within:
            motion[POSE_SIZE:] = 0.0

    def _write_along(self, t: float, motion: Array) -> None:
        position = self._position
        motion[POSITION] = position.value(t).ravel()
        motion[LINEAR_VELOCITY] = position.EvalDerivative(t, 1).ravel()
        motion[LINEAR_ACCELERATION] = position.EvalDerivative(t, 2).ravel()
        rotation = self._rotation
        if isinstance(rotation, PiecewiseQuaternionSlerp):
            motion[QUATERNION] = rotation.orientation(t).wxyz()
            motion[ANGULAR_VELOCITY] = rotation.angular_velocity(t)
            motion[ANGULAR_ACCELERATION] = rotation.angular_acceleration(t)
            return
        Q, dQ, ddQ = (rotation.EvalDerivative(t, order).ravel() for order in range(3))
        motion[QUATERNION] = quaternion.normalized(Q)
        w, dw = quaternion.angular_motion(Q, dQ, ddQ)
        motion[ANGULAR_VELOCITY], motion[ANGULAR_ACCELERATION] = w, dw

    def _warn_of_jumps(self) -> None:
        motion = np.empty(FRAME_MOTION_SIZE)
        for name, time in (("begins", self._start), ("ends", self.end)):
            self._write_along(time, motion)
            v, w = (np.linalg.norm(motion[part]) for part in (LINEAR_VELOCITY, ANGULAR_VELOCITY))
            if max(v, w) > _AT_REST:
                _log.warning(
                    f"The trajectory of D {name} at t = {time:g} s with {v:.3g} m/s and {w:.3g} "
                    f"rad/s; D rests outside of it, so its velocity jumps there."
                )


def _usable(trajectory: Trajectory, size: int, name: str) -> Trajectory:
    """Returns a copy of a trajectory of a vector; raises ConfigurationError for any other."""
    rows, cols = trajectory.rows(), trajectory.cols()
    if rows * cols != size:
        raise ConfigurationError(
            f"The trajectory of D's {name} has values of {rows}×{cols}; give {size}."
        )
    if not trajectory.has_derivative():
        raise ConfigurationError(
            f"The trajectory of D's {name}, a {type(trajectory).__name__}, has no derivatives, and "
            f"an impedance needs two; a PiecewisePolynomial has them."
        )
    return trajectory.Clone()


def _constant(R_WD: RotationMatrix, during: Trajectory) -> Trajectory:
    Q = R_WD.ToQuaternion()
    return PiecewiseQuaternionSlerp([during.start_time(), during.end_time()], [Q, Q])


def _span(position: Trajectory, rotation: Trajectory) -> tuple[float, float]:
    """Returns start and end of two trajectories, which must be the same."""
    start, end = position.start_time(), position.end_time()
    if max(abs(rotation.start_time() - start), abs(rotation.end_time() - end)) > 1e-9:
        raise ConfigurationError(
            f"The position of D is from t = {start:g} to {end:g} s and its rotation from "
            f"{rotation.start_time():g} to {rotation.end_time():g} s; give both the same times."
        )
    return start, end
