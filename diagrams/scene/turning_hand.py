"""Somebody's hand on the end effector: it turns it round a closed loop of orientations."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce, SpatialVelocity
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import Frame
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.sources.external_wrench import linear_with_fourth_order_blends
from geoimp_drake.typing import Array
from geoimp_drake.validation import key, positive, whole_number

__all__ = ["HandConfig", "TurningHand", "orientation_loop"]

_STEP = 1e-4  # of the difference that gives the hand's angular velocity [s]
_MOST_LAPS = 1000


def orientation_loop(s: float) -> Array:
    """Returns Q_CD (4,) on a closed loop within 71° of D, s from 0 to 2π.

    It is not its own mirror image: round such a loop even a spring without a potential may do no
    work.
    """
    turn = np.array([0.2 + 0.9 * np.cos(s), 0.1 + 0.9 * np.sin(s), 0.6 * np.cos(2.0 * s + 0.5)])
    return quaternion.exp(turn)


@dataclass
class HandConfig:
    """How a hand holds the end effector, and how often and how fast it turns that round.

    Every lap begins and ends at rest.
    """

    stiffness: float = 60.0  # of its grasp [Nm/rad]
    damping: float = 4.0  # of the same [Nms/rad]
    laps: int = 2  # forward; then as many back
    lap: float = 8.0  # duration of a lap [s]
    rest: float = 0.5  # before each, and at the end [s]
    lead: float = 2.0  # from D to the beginning of the loop [s]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        positive(self.stiffness, key(name, "stiffness"), "Nm/rad")
        positive(self.damping, key(name, "damping"), "Nms/rad")
        whole_number(self.laps, key(name, "laps"), 1, _MOST_LAPS)
        for time in ("lap", "rest", "lead"):
            positive(getattr(self, time), key(name, time), "s")

    def phases(self) -> Iterator[tuple[str, float, float]]:
        """Yields name, begin and end of the motion to the loop, and of each lap [s]."""
        yield "lead", 0.0, self.lead
        for lap in range(2 * self.laps):
            begin = self.lead + self.rest + lap * (self.lap + self.rest)
            yield ("forward" if lap < self.laps else "back"), begin, begin + self.lap

    @property
    def duration(self) -> float:
        """The total duration [s]."""
        return self.lead + self.rest + 2 * self.laps * (self.lap + self.rest)


class _Way:
    """A phase of the hand's motion, from rest to rest."""

    def __init__(self, name: str, begin: float, end: float):
        self.sign = -1.0 if name == "back" else 1.0
        self._begin, self._end = begin, end
        length = end - begin
        self._profile = linear_with_fourth_order_blends(begin, length, 0.25 * length)

    def done(self, time: float) -> float:
        """Returns the share that is done; it evaluates the profile only while that changes."""
        if self._begin < time < self._end:
            return float(self._profile.value(time)[0, 0])
        return float(time >= self._end)


class TurningHand(LeafSystem):
    """A spring and a damper between the end effector E and a hand H that goes round a loop.

    Its moment on E is K_h θ + D_h (ω_H − ω_E), all in W, where θ is the rotation vector from E to
    H. It leaves the position to the arm.

    Args:
        frame: E.
        hand: its motion.
        Q_WD: attitude of D (4,), which rests; E starts there.

    Ports:
        input body_poses: of the plant, abstract
        input body_spatial_velocities: of the plant, abstract
        output applied_spatial_force: for the plant's port, list of ExternallyAppliedSpatialForce
        output moment: by the hand on E, in W [Nm] (3)
    """

    def __init__(self, frame: Frame, hand: HandConfig, Q_WD: Array):
        super().__init__()
        self._frame, self._hand, self._Q_WD = frame, hand, Q_WD
        self._ways = [_Way(*phase) for phase in hand.phases()]
        self._poses = self.DeclareAbstractInputPort(
            "body_poses", AbstractValue.Make([RigidTransform()])
        )
        self._velocities = self.DeclareAbstractInputPort(
            "body_spatial_velocities", AbstractValue.Make([SpatialVelocity()])
        )
        applied = ExternallyAppliedSpatialForce()
        applied.body_index = frame.body().index()
        applied.p_BoBq_B = frame.GetFixedPoseInBodyFrame().translation()
        self.DeclareAbstractOutputPort(
            "applied_spatial_force", lambda: AbstractValue.Make([applied]), self._apply
        )
        self.DeclareVectorOutputPort("moment", 3, self._write_moment)

    def attitude(self, time: float) -> Array:
        """Returns Q_WH (4,)."""
        lead, *laps = self._ways
        s = 2.0 * np.pi * sum(lap.sign * lap.done(time) for lap in laps)
        Q_HD = quaternion.exp(lead.done(time) * quaternion.log(orientation_loop(s)))
        return quaternion.product(self._Q_WD, quaternion.conjugate(Q_HD))

    def _moment(self, context: Context) -> Array:
        body, time = self._frame.body().index(), context.get_time()
        X_WB, V_WB = (port.Eval(context)[body] for port in (self._poses, self._velocities))
        R_WE = (X_WB.rotation() @ self._frame.GetFixedPoseInBodyFrame().rotation()).matrix()
        Q_EW = quaternion.conjugate(quaternion.from_rotation(R_WE))
        turn = quaternion.log(quaternion.product(self.attitude(time), Q_EW))
        before, after = (self.attitude(time + step) for step in (-_STEP, _STEP))
        w_WH = quaternion.log(quaternion.product(after, quaternion.conjugate(before))) / (2 * _STEP)
        return self._hand.stiffness * turn + self._hand.damping * (w_WH - V_WB.rotational())

    def _apply(self, context: Context, output: AbstractValue) -> None:
        applied = output.get_value()
        applied[0].F_Bq_W = SpatialForce(tau=self._moment(context), f=np.zeros(3))
        output.set_value(applied)

    def _write_moment(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._moment(context))
