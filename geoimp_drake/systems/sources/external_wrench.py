"""An external wrench on a body: a ramp in time, through Drake's applied-force port."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd
from pydrake.common.value import AbstractValue
from pydrake.multibody.math import SpatialForce, SpatialForce_
from pydrake.multibody.plant import ExternallyAppliedSpatialForce, ExternallyAppliedSpatialForce_
from pydrake.multibody.tree import Frame
from pydrake.polynomial import Polynomial
from pydrake.systems.framework import Context, LeafSystem_
from pydrake.trajectories import PiecewisePolynomial

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.systems.part_shell import seconds
from geoimp_drake.systems.part_system import Block
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, choice, finite_vector, key, non_negative, positive

__all__ = ["ExternalWrench", "WrenchRamp", "linear_with_fourth_order_blends"]


@dataclass
class WrenchRamp:
    """A wrench on a body that grows from zero to its final value, and then stays or falls again."""

    moment: Array = field(default_factory=lambda: np.zeros(3))  # final, on the body [Nm]
    force: Array = field(default_factory=lambda: np.zeros(3))  # final, on the body [N]
    axes: str = "world"  # of both; or frame: the axes at the start of the frame where it acts
    start: float = 0.0  # [s]
    duration: float = 1.0  # of the ramp, blends included [s]
    blend: float = 0.2  # of each blend [s]
    until: float | None = None  # when it begins to fall, as it rose [s]; null: it stays

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        finite_vector(self.moment, key(name, "moment"), 3)
        finite_vector(self.force, key(name, "force"), 3)
        choice(self.axes, key(name, "axes"), ("world", "frame"))
        non_negative(self.start, key(name, "start"), "s")
        positive(self.duration, key(name, "duration"), "s")
        positive(self.blend, key(name, "blend"), "s")
        end = self.start + self.duration
        if end - self.blend == end:
            raise ConfigurationError(
                f"{key(name, 'blend')} is {self.blend:g} s, which is lost in rounding at {end:g} "
                f"s, the end of the ramp; give a longer one."
            )
        if self.blend > self.duration / 2:
            raise ConfigurationError(
                f"{key(name, 'blend')} is {self.blend:g} s; two of them must fit into "
                f"{key(name, 'duration')}, {self.duration:g} s."
            )
        if self.until is not None and not self.until >= end:
            raise ConfigurationError(
                f"{key(name, 'until')} is {self.until:g} s; the wrench has its full size at "
                f"{end:g} s and cannot end before. Give a later time, or null to keep it."
            )

    def profile(self) -> Callable[[float], float]:
        """Returns the share of the final wrench that acts, as a function of time [s]."""
        ramp = linear_with_fourth_order_blends(self.start, self.duration, self.blend)
        if self.until is None:
            return lambda time: float(ramp.value(time)[0, 0])
        stays = self.until - self.start
        return lambda time: float((ramp.value(time) - ramp.value(time - stays))[0, 0])


def linear_with_fourth_order_blends(
    start: float, duration: float, blend: float
) -> PiecewisePolynomial:
    """Returns the profile from 0 to 1 that is linear with fourth-order blends.

    A blend of duration b takes the rate from 0 to r as r b (σ³ − σ⁴/2), σ = (t − t_0)/b. The rate
    and its derivative are continuous at both ends. Over the whole ramp r = 1/(duration − blend).

    Args:
        start: [s]; the profile is zero before.
        duration: of the ramp, blends included [s]; the profile is one afterwards.
        blend: of each blend [s], at most half the duration.
    """
    rate, linear = 1.0 / (duration - blend), duration - 2.0 * blend
    pieces, breaks = [_first_blend(rate, blend)], [start, start + blend]
    if start + blend < (last := start + blend + linear):
        pieces.append(Polynomial([rate * blend / 2.0, rate]))
        breaks.append(last)
    pieces.append(_last_blend(rate, blend))
    breaks.append(start + duration)
    return PiecewisePolynomial([np.array([[piece]]) for piece in pieces], breaks)


def _first_blend(rate: float, blend: float) -> Polynomial:
    """Returns p(t) = r (t³/b² − t⁴/(2 b³))."""
    return Polynomial([0.0, 0.0, 0.0, rate / blend**2, -rate / (2.0 * blend**3)])


def _last_blend(rate: float, blend: float) -> Polynomial:
    """Returns 1 − p(b − t), the first blend turned round, by its Taylor coefficients at t = 0."""
    cubic, quartic = -rate / blend**2, rate / (2.0 * blend**3)
    return Polynomial([1.0 - rate * blend / 2.0, rate, 0.0, cubic, quartic])


class ExternalWrench(Block):
    """Applies a wrench to a frame of a plant: zero first, then a ramp, then constant or zero again.

    The ramp is linear with fourth-order blends. The wrench is that on the body, acts at the frame's
    origin and keeps its direction in W.

    Args:
        frame: F, at which the wrench acts.
        ramp: final wrench, its axes and its timing.
        R_WF0: rotation matrix (3×3) of F at the start, for a wrench in those axes.

    Raises:
        ConfigurationError: a field of the ramp cannot be used, or R_WF0 is missing.

    Ports:
        output applied_spatial_force: for the plant's port, list of ExternallyAppliedSpatialForce
    """

    def __init__(self, frame: Frame, ramp: WrenchRamp, R_WF0: Array | None = None):
        super().__init__()
        check(ramp, "external")
        R = np.eye(3) if ramp.axes == "world" else R_WF0
        if R is None:
            raise ConfigurationError(
                "external.axes is 'frame'; give R_WF0, how the frame is turned at the start."
            )
        applied = ExternallyAppliedSpatialForce()
        applied.body_index = frame.body().index()
        applied.p_BoBq_B = frame.GetFixedPoseInBodyFrame().translation()
        self._final = SpatialForce(
            tau=R @ np.asarray(ramp.moment, dtype=float), f=R @ np.asarray(ramp.force, dtype=float)
        )
        self._profile, self._applied = ramp.profile(), applied
        self.DeclareAbstractOutputPort(
            "applied_spatial_force",
            lambda: AbstractValue.Make([applied]),
            self._calc_force,
            {self.time_ticket()},
        )

    def to_autodiff(self) -> Any:
        """Returns the same for `AutoDiffXd`, without derivatives by the time."""
        return _AutoDiffWrench(self._applied, self._final, self._profile)

    def _calc_force(self, context: Context, output: AbstractValue) -> None:
        applied = output.get_value()
        applied[0].F_Bq_W = self._final * self._profile(context.get_time())
        output.set_value(applied)


class _AutoDiffWrench(LeafSystem_[AutoDiffXd]):
    """An external wrench for `AutoDiffXd`: where it acts, its final value and its share by time."""

    def __init__(
        self,
        applied: ExternallyAppliedSpatialForce,
        final: SpatialForce,
        profile: Callable[[float], float],
    ):
        LeafSystem_[AutoDiffXd].__init__(self)
        self._final, self._profile = final.get_coeffs(), profile
        model = ExternallyAppliedSpatialForce_[AutoDiffXd]()
        model.body_index, model.p_BoBq_B = applied.body_index, applied.p_BoBq_B
        self.DeclareAbstractOutputPort(
            "applied_spatial_force",
            lambda: AbstractValue.Make([model]),
            self._calc_force,
            {self.time_ticket()},
        )

    def _calc_force(self, context: Any, output: AbstractValue) -> None:
        applied, F = output.get_value(), self._final * self._profile(seconds(context.get_time()))
        applied[0].F_Bq_W = SpatialForce_[AutoDiffXd](tau=F[:3], f=F[3:])
        output.set_value(applied)
