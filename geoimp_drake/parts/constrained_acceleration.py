"""The joint acceleration within the limits, between the task and inverse dynamics."""

import numpy as np

from geoimp_drake.arm.control_model import TASK_DIMENSION
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.compositions.limit_test import limit_test
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.parts.joint_limits import SLACK, UNLIMITED, JointLimits
from geoimp_drake.parts.part import Now, Output, held
from geoimp_drake.parts.signals import check_signal
from geoimp_drake.typing import Array

__all__ = ["ConstrainedAcceleration"]


class ConstrainedAcceleration:
    """The part of `systems.arm.constrained_acceleration.ConstrainedAcceleration`.

    Args:
        limits: of the arm.
    """

    float_only = "solves a quadratic program in floats"

    def __init__(self, limits: JointLimits):
        self._limits, self._n, self._law = limits, limits.num_joints, compiled(limit_test)
        self._is_finite = compiled(is_finite)
        self.inputs = {
            "joint_acceleration": self._n,
            "task_acceleration": TASK_DIMENSION,
            "arm": object(),
            "wrench": 6,
        }
        self.memory = limits.memory
        self._acts = limits.memory.acts
        self.found_of = tuple(self.inputs)
        self.outputs = (
            Output("joint_acceleration", self._n, _write_acceleration, ("found",)),
            Output("slack", 6, _write_slack, ("found",)),
            held("limited", limits.memory.limited),
        )

    def new_found(self) -> list[Array]:
        """Returns a list for α (n,) and `Limited` (10,)."""
        return [np.empty(self._n), UNLIMITED]

    def find(self, now: Now, found: list[Array]) -> None:
        """Puts α and `Limited` into the list; α is `joint_acceleration` as long as no limit binds.

        Raises:
            SignalError: the wrench or the joint acceleration is NaN or infinite.
        """
        arm, h, alpha = now["arm"], now["wrench"], now["joint_acceleration"]
        for name, value in (("wrench", h), ("joint_acceleration", alpha)):
            if not self._is_finite(value):
                check_signal(value, now.port(name))
        x = np.concatenate((arm.q, arm.v))
        dynamics = arm.Jv_V_WE, arm.B, arm.Cv, arm.Fv, arm.g
        found[:] = alpha, UNLIMITED
        if self._law(*dynamics, h, x, alpha, *self._limits.arguments):
            found[:] = self._limits.constrained(arm, h, now["task_acceleration"], alpha)

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Keeps what the limits do in the step that begins; warns of each kind of limit once."""
        limited = now.found[1]
        if limited is not UNLIMITED or memory[self._acts]:
            self._limits.keep(memory, limited, now.system, now.time)


def _write_acceleration(now: Now, alpha: Array) -> None:
    alpha[:] = now.found[0]


def _write_slack(now: Now, slack: Array) -> None:
    slack[:] = now.found[1][SLACK]
