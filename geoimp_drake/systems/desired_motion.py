"""The desired motion of D: straight lines, turns about fixed axes, rests; fifth-order in time."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, LeafSystem
from pydrake.trajectories import BezierCurve, CompositeTrajectory, StackedTrajectory

from geoimp_drake.compiled import compiled
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.motion_about_axis import motion_about_axis
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.frame_motion import (
    POSITION,
    QUATERNION,
    frame_motion_at_rest,
    frame_motion_vector,
)
from geoimp_drake.typing import Array

__all__ = ["DesiredMotion", "MotionSegment", "phases_of"]


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

    def validate(self, where: str = "segment") -> None:
        """Raises ConfigurationError if a field cannot be used; `where` names the segment."""
        if not (np.isfinite(self.duration) and self.duration > 0):
            raise ConfigurationError(
                f"{where}: duration is {self.duration:g} s; it must be positive and finite."
            )
        for key in ("displacement", "rotation"):
            value = np.asarray(getattr(self, key), dtype=float)
            if value.shape != (3,) or not np.isfinite(value).all():
                raise ConfigurationError(f"{where}: {key} is {value}; give three finite numbers.")


def phases_of(segments: Sequence[MotionSegment]) -> list[tuple[str, float, float]]:
    """Returns name, begin and end [s] of each named segment."""
    ends = np.cumsum([segment.duration for segment in segments])
    return [
        (segment.name, float(end - segment.duration), float(end))
        for segment, end in zip(segments, ends, strict=True)
        if segment.name
    ]


class DesiredMotion(LeafSystem):
    """Source of the desired motion: a sequence of segments that starts at a given pose.

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
        super().__init__()
        for k, segment in enumerate(segments):
            segment.validate(f"motion segment {k}")
        self._start = frame_motion_at_rest(X_WD)
        self._curve = _curve(X_WD.translation(), segments)
        self._end_times = np.cumsum([segment.duration for segment in segments]).tolist()
        self._axes = [_axis(segment.rotation) for segment in segments]
        self._starts = _orientations(self._start[QUATERNION], segments)
        self._law = compiled(motion_about_axis)
        self._rests = _rests(self._start, self._starts, segments)
        self.DeclareVectorOutputPort(
            "motion",
            frame_motion_vector(),
            self._calc_motion,
            prerequisites_of_calc={self.time_ticket()},
        )

    def duration(self) -> float:
        """Returns the time at which the last segment ends [s]."""
        return self._end_times[-1] if self._end_times else 0.0

    def evaluate(self, time: float) -> Array:
        """Returns the motion of D at a time [s], as the output port does."""
        if self._curve is None:
            return self._start
        t = min(max(time, 0.0), self.duration())
        k = min(bisect_right(self._end_times, t), len(self._axes) - 1)
        if (rest := self._rests[k]) is not None:
            return rest
        return self._law(self._curve.value(t)[:, 0], self._axes[k], self._starts[k])

    def _calc_motion(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.evaluate(context.get_time()))


def _curve(p_WD: Array, segments: Sequence[MotionSegment]) -> StackedTrajectory | None:
    """Returns [p_d; angle within the segment] over time, then its first and second derivative.

    A Bézier curve of degree five whose control points are three times the start and three times
    the end is the fifth-order polynomial with zero end velocities and accelerations.
    """
    curves = []
    start_time, start = 0.0, np.append(p_WD, 0.0)
    for segment in segments:
        start[3] = 0.0
        end = start + np.append(segment.displacement, np.linalg.norm(segment.rotation))
        points = np.column_stack([start] * 3 + [end] * 3)
        curves.append(BezierCurve(start_time, start_time + segment.duration, points))
        start_time, start = start_time + segment.duration, end.copy()
    if not curves:
        return None
    curve, stacked = CompositeTrajectory(curves), StackedTrajectory()
    for order in range(3):
        stacked.Append(curve.MakeDerivative(order))
    return stacked


def _axis(rotation: Array) -> Array:
    angle = np.linalg.norm(rotation)
    return np.asarray(rotation) / angle if angle > 0 else np.zeros(3)


def _orientations(Q_WD: Array, segments: Sequence[MotionSegment]) -> list[Array]:
    """Returns the quaternion of D at the start of each segment."""
    starts = [Q_WD]
    for segment in segments:
        starts.append(quaternion.product(quaternion.exp(np.asarray(segment.rotation)), starts[-1]))
    return starts


def _rests(
    start: Array, orientations: Sequence[Array], segments: Sequence[MotionSegment]
) -> list[Array | None]:
    """Returns the motion during each segment that is a rest: nothing to compute there any more."""
    rests: list[Array | None] = []
    position = start[POSITION]
    for Q_WD, segment in zip(orientations, segments, strict=False):  # the last is the end's
        position = position + segment.displacement
        rest = start.copy()
        rest[QUATERNION], rest[POSITION] = Q_WD, position
        moves = np.any(segment.displacement) or np.any(segment.rotation)
        rests.append(None if moves else rest)
    return rests
