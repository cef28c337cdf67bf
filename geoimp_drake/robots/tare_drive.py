"""Drives an arm to several postures, one after the other, and reads it while it rests there."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from pydrake.multibody.tree import JacobianWrtVariable

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.laws.frame_motion import VELOCITY
from geoimp_drake.laws.smooth_rest import smooth_step
from geoimp_drake.parts.supervisor import Mode
from geoimp_drake.robots.drive_log import DriveLog
from geoimp_drake.robots.robot_arm import RobotArm, RobotError, RobotStatus
from geoimp_drake.robots.tare import TareReading, mean_at_rest
from geoimp_drake.rotations import quaternion
from geoimp_drake.task_functions.posture import Posture
from geoimp_drake.task_functions.task_function import Instant, TaskValue
from geoimp_drake.typing import Array

__all__ = ["PostureTour", "TourPosture", "readings_of"]

# Largest joint speed between postures [rad/s, m/s], and how long each posture is kept [s].
_SPEED, _DWELL = 0.4, 1.0

# A rest with fewer rows does not count; of the others the second half is read.
_ROWS = 10

# The largest speed of a motion from rest to rest, times its duration, divided by its length.
_PEAK = 1.875


class TourPosture:
    """w of `Posture` about a tour's q_d instead of the start's posture; descend it (k_β < 0).

    D alone does not determine a redundant arm's null-space motion.

    Args:
        model: the arm.
    """

    def __init__(self, model: ControlModel):
        self._posture = Posture(model)
        self._q, self._v = np.zeros((2, model.num_joints))

    def follow(self, q: Array, v: Array) -> None:
        """Takes q_d and its velocity at the tour's time, which stands still in a hold."""
        self._q, self._v = q, v

    def evaluate(self, instant: Instant) -> TaskValue:
        """Returns w and its derivatives; Ḃ(q_d) is left out, since q is near q_d."""
        apart = replace(instant, v=instant.v - self._v, start_posture=self._q)
        return self._posture.evaluate(apart)


class PostureTour:
    """A motion of D that takes all joints from rest to rest, and lets them rest in each posture.

    Between two postures s(t) runs from 0 to 1 as `smooth_step` does. Then q = q_k + s Δq, V = J ṡ
    Δq, A = J s̈ Δq + J̇ ṡ Δq.

    Args:
        model: the arm.
        postures: those after the first, which is where the arm is; each (n), base first.

    Attributes:
        duration: total time [s]; known after `begin`.
        task: keeps a redundant arm's joints at q_d.
    """

    def __init__(self, model: ControlModel, postures: list[Array]):
        self._model, self._postures = model, postures
        self._context = model.plant.CreateDefaultContext()
        self.task = TourPosture(model)

    def begin(self, first: Array) -> None:
        """Puts the arm's present posture before the others."""
        self._postures = [first, *self._postures]
        ways = [np.abs(np.diff(pair, axis=0)).max() for pair in pairwise(self._postures)]
        self._moves = [max(_PEAK * float(way) / _SPEED, _DWELL) for way in ways]
        self._begins = np.cumsum([0.0, *(move + _DWELL for move in self._moves)])
        self.duration = float(self._begins[-1])

    def evaluate(self, time: float) -> Array:
        """Returns the motion of D (19) at a time [s]."""
        k = int(np.searchsorted(self._begins[1:-1], time, side="right"))
        s, ds, dds = smooth_step(time - self._begins[k], self._moves[k])
        first, way = self._postures[k], self._postures[k + 1] - self._postures[k]
        plant, context, E = self._model.plant, self._context, self._model.end_effector
        self.task.follow(first + s * way, ds * way)
        plant.SetPositions(context, first + s * way)
        plant.SetVelocities(context, ds * way)
        W, kind = self._model.world, JacobianWrtVariable.kV
        J = plant.CalcJacobianSpatialVelocity(context, kind, E, np.zeros(3), W, W)
        bias = plant.CalcBiasSpatialAcceleration(context, kind, E, np.zeros(3), W, W)
        X_WE = E.CalcPoseInWorld(context)
        Q, p = quaternion.from_rotation(X_WE.rotation().matrix()), X_WE.translation()
        return np.concatenate((Q, p, ds * J @ way, dds * J @ way + bias.get_coeffs()))


def readings_of(
    log: DriveLog, count: int, robot: RobotArm, model: ControlModel, *, at_wrist: bool
) -> list[TareReading]:
    """Returns the readings in each posture of a drive.

    Args:
        log: of the drive.
        count: number of postures.
        robot: the one that was driven.
        model: the arm with its weight, without the unknown load.
        at_wrist: reads the wrench instead of the torques.

    Raises:
        RobotError: the drive ended before the last posture; or as in `read_at_rest`.
    """
    rows = log.whole
    rests = np.isin(rows["mode"][:, 0], (Mode.RUN, Mode.HOLD))
    rests &= (rows["motion_D"][:, VELOCITY] == 0.0).all(axis=1) & np.isfinite(rows["q"][:, 0])
    places = np.flatnonzero(rests)
    groups = np.split(places, np.flatnonzero(np.diff(places) > _ROWS // 2) + 1)
    groups = [group[len(group) // 2 :] for group in groups if len(group) >= _ROWS]
    if log.failure is not None or len(groups) < count:
        raise RobotError(
            f"{robot.name} rested in {len(groups)} of {count} postures, then the drive was ended "
            f"by {log.failure or 'its supervisor'}: no load was looked for."
        )
    return [
        mean_at_rest(robot, model, [_status(rows, k) for k in group], at_wrist=at_wrist)
        for group in groups[:count]
    ]


def _status(rows: dict[str, Array], k: int) -> RobotStatus:
    t, q, v, torque = (rows[name][k] for name in ("t", "q", "v", "torque"))
    reported = (_known(rows[f"reported_{name}"][k]) for name in ("wrench", "external_torque"))
    return RobotStatus(float(t[0]), q, v, torque, *reported)


def _known(value: Array) -> Array | None:
    return value if np.isfinite(value).all() else None
