"""The desired motion of D: lines, turns about fixed axes and rests, or a trajectory of Drake's."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, Self

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import BasicVector, Context
from pydrake.trajectories import Trajectory

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.motion_about_axis import motion_from_rest
from geoimp_drake.parts.part import Memory, Now, Output
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.autodiff_part_system import autodiff_system_of
from geoimp_drake.systems.frame_motion import (
    FRAME_MOTION_SIZE,
    POSITION,
    QUATERNION,
    frame_motion_at_rest,
    frame_motion_vector,
)
from geoimp_drake.systems.part_system import Block
from geoimp_drake.systems.sources.trajectory import TrajectoryOfD
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, finite_vector, key, positive

__all__ = ["DesiredMotion", "MotionSegment", "length_of", "phases_of"]


@dataclass
class MotionSegment:
    """A part of a desired motion, from rest to rest.

    Both parts run along the same fifth-order polynomial of time with zero end velocities and
    accelerations. A segment without displacement and rotation is a rest.
    """

    duration: float = 1.0  # [s]
    displacement: Array = field(default_factory=lambda: np.zeros(3))  # of D's origin, in W [m]
    rotation: Array = field(default_factory=lambda: np.zeros(3))  # axis times angle, in W [rad]
    name: str = ""  # names the phase in logs and figures

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        positive(self.duration, key(name, "duration"), "s")
        finite_vector(self.displacement, key(name, "displacement"), 3)
        finite_vector(self.rotation, key(name, "rotation"), 3)


def length_of(segments: Sequence[MotionSegment]) -> float:
    """Returns the total duration of segments [s]."""
    return _times_of(segments)[-1]


def phases_of(segments: Sequence[MotionSegment]) -> list[tuple[str, float, float]]:
    """Returns name, begin and end [s] of each named segment."""
    return [
        (segment.name, end - segment.duration, end)
        for segment, end in zip(segments, _times_of(segments)[1:], strict=True)
        if segment.name
    ]


def _times_of(segments: Sequence[MotionSegment]) -> list[float]:
    """Returns when each segment begins, and when the last one ends [s]."""
    times: list[float] = np.cumsum([0.0, *(segment.duration for segment in segments)]).tolist()
    return times


class _Path(Protocol):
    """A motion of D over time; it ends at the time `end` [s]."""

    end: float

    def write(self, time: float, motion: Array) -> None: ...


class DesiredMotion(Block):
    """Source of the desired motion: a sequence of segments that starts at a given pose.

    `DesiredMotion.along` follows a trajectory of Drake's instead.

    Along segment k of duration T, with s(τ) = 10τ³ − 15τ⁴ + 6τ⁵ and τ = (t − t_k)/T,

        p_d = p_k + s Δp,   R_d = exp(s θ S(r)) R_k,   ω_d = ṡ θ r,   v_d = ṡ Δp,

    and accelerations likewise with s̈. Before the first segment D rests at X_WD, after the last
    one at the end pose.

    Args:
        X_WD: the pose of D at time zero.
        segments: the motion's parts in order; none means rest.

    Raises:
        ConfigurationError: a segment's duration or displacement cannot be used.

    Ports:
        output motion: the motion of D in W (19)
    """

    def __init__(self, X_WD: RigidTransform, segments: Sequence[MotionSegment] = ()):
        self._follow(_Segments(X_WD, segments))

    @classmethod
    def along(
        cls, trajectory: Trajectory, rotation: Trajectory | RotationMatrix | None = None
    ) -> Self:
        """Returns a source of a motion along a trajectory, over the simulation's time.

        Velocities and accelerations are the trajectory's derivatives; before its start and after
        its end D rests. Where they jump, in its course or at its ends, so do those of D.

        Args:
            trajectory: a `PiecewisePose` of D in W; or any trajectory of D's origin (3) [m] that
                has derivatives, with a rotation.
            rotation: how D is turned meanwhile: a `PiecewiseQuaternionSlerp`, any trajectory of a
                quaternion [w, x, y, z] (4), which is normalized, or one attitude R_WD.

        Raises:
            ConfigurationError: a trajectory has another size, other times or no derivatives.
        """
        source = cls.__new__(cls)
        source._follow(TrajectoryOfD(trajectory, rotation))
        return source

    def _follow(self, path: _Path) -> None:
        Block.__init__(self)
        self._path = path
        self.DeclareVectorOutputPort(
            "motion",
            frame_motion_vector(),
            self._calc_motion,
            prerequisites_of_calc={self.time_ticket()},
        )

    def to_autodiff(self) -> Any:
        """Returns the same for `AutoDiffXd`, without derivatives by the time."""
        return autodiff_system_of(_Followed(self._path))

    def duration(self) -> float:
        """Returns the time at which the last segment, or the trajectory, ends [s]."""
        return self._path.end

    def evaluate(self, time: float) -> Array:
        """Returns the motion of D at a time [s], as the output port does."""
        motion = np.empty(FRAME_MOTION_SIZE)
        self._path.write(time, motion)
        return motion

    def _calc_motion(self, context: Context, output: BasicVector) -> None:
        self._path.write(context.get_time(), output.get_mutable_value())


class _Followed:
    """A part: a path, followed over the time."""

    def __init__(self, path: _Path):
        self._path, self.memory = path, Memory()
        self.inputs: dict[str, Any] = {}
        self.outputs = (Output("motion", FRAME_MOTION_SIZE, self._write, ("time",)),)

    def _write(self, now: Now, motion: Array) -> None:
        self._path.write(now.time, motion)


class _Segments:
    """Segments one after the other, see `DesiredMotion`."""

    def __init__(self, X_WD: RigidTransform, segments: Sequence[MotionSegment]):
        for k, segment in enumerate(segments):
            check(segment, f"segments.{k}")
        self._durations = [float(segment.duration) for segment in segments]
        self._times = _times_of(segments)
        self._rests = _rests(frame_motion_at_rest(X_WD), segments)
        self._ways = [*(_way(segment) for segment in segments), None]  # at the end D rests
        self._law = compiled(motion_from_rest)
        self.end = self._times[-1]
        # Compiled now, and not when the first rest ends: a robot would wait.
        for time, way in zip(self._times, self._ways, strict=True):
            if way is not None:
                self.write(time, np.empty(FRAME_MOTION_SIZE))
                break

    def write(self, time: float, motion: Array) -> None:
        """Writes the motion of D at a time [s]."""
        k = bisect_right(self._times, time) - 1 if time > 0.0 else 0
        way = self._ways[k]
        if way is None:
            motion[:] = self._rests[k]
        else:
            self._law(time - self._times[k], self._durations[k], self._rests[k], way, motion)


def _way(segment: MotionSegment) -> Array | None:
    """Returns displacement, angle and axis (7) of a segment, nothing for a rest."""
    angle = np.linalg.norm(segment.rotation)
    axis = np.asarray(segment.rotation) / angle if angle > 0 else np.zeros(3)
    way = np.concatenate((segment.displacement, [angle], axis))
    return way if way.any() else None


def _rests(start: Array, segments: Sequence[MotionSegment]) -> list[Array]:
    """Returns the motion (19) of D at rest: where each segment starts, then where the last ends."""
    rests = [start]
    for segment in segments:
        end = rests[-1].copy()
        turn = quaternion.exp(np.asarray(segment.rotation, dtype=float))
        end[QUATERNION] = quaternion.product(turn, end[QUATERNION])
        end[POSITION] += segment.displacement
        rests.append(end)
    return rests
