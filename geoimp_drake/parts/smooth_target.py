"""A live target pose, smoothed into a desired motion."""

import numpy as np
from pydrake.math import RigidTransform

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE, POSE_SIZE, QUATERNION
from geoimp_drake.laws.target_filter import target_filter
from geoimp_drake.parts.part import Memory, Now, Output
from geoimp_drake.parts.signals import check_signal
from geoimp_drake.rotations.quaternion import normalized
from geoimp_drake.typing import Array
from geoimp_drake.validation import positive

__all__ = ["SmoothedTarget"]

# (1 + x + x²/2) exp(−x) = 0.01: three equal poles leave 1 % of a step after x time constants.
_SETTLED = 8.4059


class SmoothedTarget:
    """The part of `SmoothTarget`; arguments and errors are the same."""

    def __init__(
        self,
        X_WD: RigidTransform,
        settling: float = 1.0,
        speed: float = np.inf,
        angular_speed: float = np.inf,
    ):
        positive(settling, "settling", "s")
        for name, value in (("speed", speed), ("angular_speed", angular_speed)):
            if not value > 0:
                raise ConfigurationError(f"{name} is {value}; it must be positive, or infinite.")
        self._law = compiled(target_filter)
        self._numbers = _SETTLED / settling, float(speed), float(angular_speed)
        self._start = _pose_vector(X_WD)
        at_rest = np.zeros(FRAME_MOTION_SIZE)
        at_rest[:POSE_SIZE] = self._start
        self.inputs = {"target": RigidTransform()}
        self.memory = Memory()
        self.state = Memory(motion=at_rest)
        self.outputs = (Output("motion", FRAME_MOTION_SIZE, self._write, ("state",)),)

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Keeps the quaternion normalized."""
        state[QUATERNION] = normalized(state[QUATERNION])

    def rate(self, now: Now, rate: Array) -> None:
        """Writes the derivative of the motion."""
        target = self._start
        if now.has("target"):
            target = _pose_vector(now["target"])
            check_signal(target, now.port("target"))
        self._law(now.state, target, *self._numbers, rate)

    def _write(self, now: Now, motion: Array) -> None:
        motion[:] = now.state
        motion[QUATERNION] = normalized(motion[QUATERNION])


def _pose_vector(X: RigidTransform) -> Array:
    return np.array([*X.rotation().ToQuaternion().wxyz(), *X.translation()])
