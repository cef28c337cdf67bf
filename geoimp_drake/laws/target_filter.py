"""How a frame follows a target pose that may change at any time, with a continuous acceleration."""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import sized
from geoimp_drake.laws.frame_motion import (
    ACCELERATION,
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSE_SIZE,
    POSITION,
    QUATERNION,
    VELOCITY,
)
from geoimp_drake.rotations.quaternion import conjugate, log, normalized, product, rate
from geoimp_drake.typing import Array

__all__ = ["target_filter"]


@compilable
def _jerk(pole: float, error: Array, v: Array, a: Array, speed: float) -> Array:
    """Returns λ³ e − 3λ² v − 3λ a, with e shortened to 3 speed/λ, so that v tends to the speed."""
    longest, square = 3.0 * speed / pole, error @ error
    # This avoids the root at zero, which has no derivative.
    share = longest / np.sqrt(square) if square > longest * longest else 1.0
    return pole * (pole * (pole * share * error - 3.0 * v) - 3.0 * a)


@compilable
def target_filter(
    motion: Array, target: Array, pole: float, speed: float, angular_speed: float, rates: Array
) -> None:
    """Writes the derivative of a frame's motion on its way to a target pose.

        p⃛ = λ³ (p_t − p) − 3λ² v − 3λ v̇,   ω̈ = λ³ log(R_t Rᵀ) − 3λ² ω − 3λ ω̇

    With three poles at −λ nothing overshoots from rest. About a fixed axis the rotation is the same
    filter of the angle. The logarithm is the rotation vector in W, up to half a turn. Position,
    velocity and acceleration stay continuous when the target jumps. Error vectors are shortened
    where v or ω would exceed the given speed; it is exceeded by at most 1 %.

    Args:
        motion: of the frame (19,), in W.
        target: pose (7,) [quaternion, position], in W.
        pole: λ [1/s].
        speed: that v is to keep to [m/s], may be infinite.
        angular_speed: that ω is to keep to [rad/s], may be infinite.
        rates: where to write the derivative of the motion (19,).
    """
    D, goal = sized(motion, FRAME_MOTION_SIZE), sized(target, POSE_SIZE)
    Q = normalized(D[QUATERNION])
    turn, way = log(product(goal[QUATERNION], conjugate(Q))), goal[POSITION] - D[POSITION]
    w, v = D[ANGULAR_VELOCITY], D[LINEAR_VELOCITY]
    rates[QUATERNION] = rate(Q, w)
    rates[POSITION] = v
    rates[VELOCITY] = D[ACCELERATION]
    rates[ANGULAR_ACCELERATION] = _jerk(pole, turn, w, D[ANGULAR_ACCELERATION], angular_speed)
    rates[LINEAR_ACCELERATION] = _jerk(pole, way, v, D[LINEAR_ACCELERATION], speed)
