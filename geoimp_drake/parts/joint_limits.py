"""An arm's limits, and the joint acceleration within them."""

import logging
from dataclasses import dataclass

import numpy as np
from pydrake.common.containers import namedview

from geoimp_drake.arm.control_model import TASK_DIMENSION, ControlModel
from geoimp_drake.arm.state import ArmState
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.limits.constrained_acceleration import constrained_acceleration
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import (
    SingularityDamping,
    smallest_singular_value,
)
from geoimp_drake.parts.hold_back import NO_SLACK
from geoimp_drake.parts.masses import Masses
from geoimp_drake.parts.part import Memory
from geoimp_drake.parts.quadratic_program import minimum
from geoimp_drake.typing import Array
from geoimp_drake.validation import key, non_negative, positive

__all__ = ["SLACK", "UNLIMITED", "JointLimits", "Limited", "LimitsConfig", "slack_of"]

_log = logging.getLogger("drake")

# k of (L.1): how fast motion in a lost direction comes to rest [1/s].
_LOST_RATE = 10.0

# ρ of (L.1), the weight of null-space motion against the task: ρB is small even where B is 100.
_NULL_SPACE_WEIGHT = 1e-6

# How close to a bound counts as on it, as a share.
_AT_BOUND = 1e-6

# The kinds of limit, and the warning when one acts.
_KINDS = {
    "position": "a joint comes near an end of its range",
    "velocity": "a joint reaches its velocity limit",
    "effort": "a joint reaches its effort limit",
    "singularity": "the arm comes near a singularity, smallest_singular_value is below {threshold}",
}

# The numbers of joints whose position, velocity and effort limits act, and whether the posture
# counts as singular. Then the slack s = Jα + J̇q̇ − a: the acceleration of E less the one that the
# task asks for [rad/s², m/s²].
_FIELDS = [
    *_KINDS,
    *(f"slack_{part}_{axis}" for part in ("rotation", "translation") for axis in "xyz"),
]
Limited = namedview("Limited", _FIELDS)

# Of a `Limited`: the slack, [angular; linear].
SLACK = slice(4, 10)

# `Limited` while no limit acts, known by its identity: a tick has no time to look at entries.
UNLIMITED = np.zeros(10)
UNLIMITED.flags.writeable = False


@dataclass
class LimitsConfig:
    """How an arm keeps its joints' position, velocity and effort limits, which its plant has."""

    margin: float = 0.02  # free at each end of a joint's range, at most a quarter of it [rad, m]
    velocity: float = 0.95  # share of the velocity limits that is used
    effort: float = 0.99  # share of the effort limits that is used
    braking: float = 0.3  # share of the used effort with which a joint brakes before its end
    horizon: float = 0.02  # T of (L.1), over which a velocity reaches its limit [s]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        non_negative(self.margin, key(name, "margin"))
        positive(self.horizon, key(name, "horizon"), "s")
        for share in ("velocity", "effort", "braking"):
            positive(getattr(self, share), key(name, share))
            if getattr(self, share) > 1:
                raise ConfigurationError(
                    f"{key(name, share)} is {getattr(self, share):g}; it is a share of the arm's "
                    f"limits: give a number up to 1."
                )


class JointLimits:
    """The limits of one arm as the laws take them.

    Args:
        model: the arm.
        config: how they are kept; None for no limits at all.
        masses: of the impedance, by which the task is weighted; unit matrices by default.
        damping: near singularities.

    Attributes:
        is_on: whether there are any.
        num_joints: n.
        threshold: smallest singular value below which a posture counts as singular.
        memory: `Limited`, which kinds have had a warning, and whether a limit acts.
        arguments: the limits (5, n), and the settings of `constrained_acceleration` (6,).
    """

    def __init__(
        self,
        model: ControlModel,
        config: LimitsConfig | None,
        masses: Masses | None = None,
        damping: SingularityDamping | None = None,
    ):
        n = model.num_joints
        self.is_on, self.num_joints = config is not None, n
        self.memory = Memory(limited=np.zeros(len(_FIELDS)), warned=np.zeros(len(_KINDS)), acts=0.0)
        damping = damping or SingularityDamping()
        self._masses = masses or Masses()
        self._law = compiled(constrained_acceleration)
        if config is None:
            none = np.full(n, np.inf)
            limits, settings = np.array([-none, none, -none, none, none]), [1.0, 1.0, 0.0]
        else:
            limits = _kept(model, config)
            settings = [config.horizon, config.braking, damping.threshold]
        weight = _NULL_SPACE_WEIGHT if n > TASK_DIMENSION else 0.0
        self.threshold: float = settings[2]
        self.arguments = limits, np.array([*settings, damping.factor, _LOST_RATE, weight])

    def constrained(self, arm: ArmState, h: Array, a: Array, alpha_0: Array) -> tuple[Array, Array]:
        """Returns the joint acceleration within the limits (n,), and `Limited` (10,).

        Args:
            arm: the arm.
            h: wrench by the end effector on the environment (6,) [Nm, N].
            a: task acceleration (6,).
            alpha_0: the joint acceleration without limits (n,); not used for six joints.

        Raises:
            SignalError: a number is not finite.
        """
        J, b = arm.Jv_V_WE, a - arm.Jdot_v
        c = arm.Cv + arm.Fv + arm.g + J.T @ h
        x = np.concatenate((arm.q, arm.v))
        H, f, lower, upper = self._law(
            J, b, arm.B, c, x, alpha_0, self._weight(arm), *self.arguments
        )
        alpha = minimum(H, f, arm.B, lower, upper)
        report = np.zeros(len(_FIELDS))
        report[:4] = *self._acting(arm, alpha, lower, upper), self._is_singular(J)
        report[SLACK] = J @ alpha - b
        return alpha, report

    def keep(self, memory: Array, limited: Array, system: str, time: float) -> None:
        """Keeps what the limits do; warns of each kind that acts for the first time.

        Args:
            memory: of this object, updated.
            limited: `Limited` (10,).
            system: the name in the warning.
            time: [s].
        """
        memory[self.memory.limited] = limited
        memory[self.memory.acts] = limited is not UNLIMITED
        if limited is UNLIMITED:
            return
        warned = memory[self.memory.warned]
        for k in np.flatnonzero((limited[: len(_KINDS)] > 0) & (warned == 0)):
            warned[k] = 1.0
            said = list(_KINDS.values())[k].format(threshold=self.threshold)
            _log.warning(f"{system}: at t = {time:.3f} s {said}; it does not follow as asked.")

    def _weight(self, arm: ArmState) -> Array:
        """Returns the mass matrix in W (6, 6), with C and D at E's attitude, the one known here."""
        return self._masses.in_world(arm.R_WE, arm.R_WE)

    def _acting(
        self, arm: ArmState, alpha: Array, lower: Array, upper: Array
    ) -> tuple[int, int, int]:
        """Returns at how many joints position, velocity and effort are at their bounds."""
        n, (limits, settings) = len(alpha), self.arguments
        at = np.concatenate((alpha, arm.B @ alpha))
        near = _AT_BOUND * np.maximum(1.0, np.abs(at))
        low, high = at <= lower + near, at >= upper - near
        # The velocity limits are the part of the box that does not depend on the position.
        speeds = (limits[2:4] - arm.v) / settings[0]
        at_speed = (low[:n] & (lower[:n] <= speeds[0])) | (high[:n] & (upper[:n] >= speeds[1]))
        effort = (low | high)[n:].sum()
        return int(((low | high)[:n] & ~at_speed).sum()), int(at_speed.sum()), int(effort)

    def _is_singular(self, J: Array) -> bool:
        return smallest_singular_value(J) < self.threshold


def _kept(model: ControlModel, config: LimitsConfig) -> Array:
    """Returns lower and upper positions, lower and upper velocities, and efforts (5, n)."""
    low, high = model.position_limits
    margin = np.minimum(config.margin, 0.25 * (high - low))
    velocities, efforts = model.velocity_limits, model.effort_limits
    return np.array(
        [
            low + margin,
            high - margin,
            *(config.velocity * velocities),
            config.effort * efforts,
        ]
    )


def slack_of(limited: Array) -> Array:
    """Returns the slack (6,) of `Limited` (10,)."""
    return NO_SLACK if limited is UNLIMITED else limited[SLACK]
