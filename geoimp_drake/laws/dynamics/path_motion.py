"""Pose and motion of a frame from those of the joints between it and the world.

Along the path the motion of a point P fixed in one body becomes that of a point Q fixed in the
next. With r from P to Q, and for a joint with axis a,

    v_Q = v_P + ω × r,   v̇_Q = v̇_P + ω̇ × r + ω × (ω × r)

    revolute:    ω̇ += a q̈ + ω × a q̇,        ω += a q̇
    prismatic:   v̇_Q += a q̈ + 2 ω × a q̇,    v_Q += a q̇

A path (n + 1, 18) has a row for every joint from the world outwards, and one for the frame E at its
end. Each row begins with the pose X_MF of `serial_chain.ChainArrays`, row by row (12). For a joint,
its axis in F (3) follows, and 1 if it is revolute or 0 if prismatic. Its places among all positions
and among all velocities are last. Floats only.
"""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import sized
from geoimp_drake.laws.frame_motion import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
)
from geoimp_drake.rotations.pose import compose
from geoimp_drake.rotations.quaternion import from_rotation
from geoimp_drake.rotations.so3 import cross, rotation_about
from geoimp_drake.typing import Array

__all__ = ["motion_along", "pose_along"]

_AXIS, _TURNS, _POSITION, _VELOCITY = slice(12, 15), 15, 16, 17
_IDENTITY, _ZERO = np.eye(3), np.zeros(3)


@compilable
def pose_along(path: Array, q: Array) -> Array:
    """Returns the pose X_WE (3, 4) of the frame at the end of a path.

    Args:
        path: the joints on the way (n + 1, 18).
        q: at least all positions [rad, m].
    """
    X_WE = np.empty((3, 4))
    R, p = sized(_IDENTITY, 3, 3), sized(_ZERO, 3)
    for j in range(len(path) - 1):
        R, p = compose(R, p, path[j, :12].reshape(3, 4))
        R, p = _moved(R, p, path[j], q[int(path[j, _POSITION])])
    R, p = compose(R, p, path[len(path) - 1, :12].reshape(3, 4))
    X_WE[:3, :3] = R
    X_WE[:3, 3] = p
    return X_WE


@compilable
def motion_along(path: Array, q: Array, v: Array, dv: Array, motion: Array) -> None:
    """Writes the motion in W of the frame at the end of a path (19,).

    Args:
        path: the joints on the way (n + 1, 18).
        q: at least all positions [rad, m].
        v: at least all velocities [rad/s, m/s].
        dv: at least all accelerations [rad/s², m/s²].
        motion: where to write.
    """
    zero = sized(_ZERO, 3)
    R, p, w, dw, v_P, a_P = sized(_IDENTITY, 3, 3), zero, zero, zero, zero, zero
    for j in range(len(path)):
        before = p
        R, p = compose(R, p, path[j, :12].reshape(3, 4))
        v_P, a_P = _carried(v_P, a_P, w, dw, before, p)
        if j < len(path) - 1:
            k, before = int(path[j, _VELOCITY]), p
            axis = R @ sized(path[j, _AXIS], 3)
            R, p = _moved(R, p, path[j], q[int(path[j, _POSITION])])
            rate, push = v[k] * axis, dv[k] * axis
            if path[j, _TURNS] > 0.0:
                dw = dw + push + cross(w, rate)
                w = w + rate
            else:
                v_P, a_P = _carried(v_P, a_P, w, dw, before, p)
                v_P = v_P + rate
                a_P = a_P + push + 2.0 * cross(w, rate)
    motion[QUATERNION] = from_rotation(R)
    motion[POSITION] = p
    motion[ANGULAR_VELOCITY] = w
    motion[LINEAR_VELOCITY] = v_P
    motion[ANGULAR_ACCELERATION] = dw
    motion[LINEAR_ACCELERATION] = a_P


@compilable
def _moved(R: Array, p: Array, joint: Array, q: float) -> tuple[Array, Array]:
    """Returns R and p of the frame that a joint moves by q from F, at the given R and p."""
    axis = sized(joint[_AXIS], 3)
    if joint[_TURNS] > 0.0:
        return R @ rotation_about(axis, q), p
    return R, p + q * (R @ axis)


@compilable
def _carried(v: Array, a: Array, w: Array, dw: Array, P: Array, Q: Array) -> tuple[Array, Array]:
    """Returns velocity and acceleration of the point at Q from those of the one at P."""
    r = Q - P
    u = cross(w, r)
    return v + u, a + cross(dw, r) + cross(w, u)
