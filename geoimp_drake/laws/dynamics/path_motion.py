"""Where a frame is and how it moves, from what the joints between it and the world do.

Along the path the motion of a point P fixed in one body becomes that of a point Q fixed in the
next: with r from P to Q, and for a joint with axis a,

    v_Q = v_P + ω × r,   v̇_Q = v̇_P + ω̇ × r + ω × (ω × r)

    revolute:    ω̇ += a q̈ + ω × a q̇,        ω += a q̇
    prismatic:   v̇_Q += a q̈ + 2 ω × a q̇,    v_Q += a q̇

A path has a row for every joint from the world outwards, and one for the frame E at its end: the
pose X_MF of `serial_chain.ChainArrays` row by row (12), then for a joint its axis in F (3), 1 if it
is revolute or 0 if prismatic, and its places among all positions and among all velocities
(n + 1, 18). Floats only.
"""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import Row, matrix
from geoimp_drake.laws.frame_motion import (
    QUATERNION,
)
from geoimp_drake.rotations.components import xyz
from geoimp_drake.rotations.quaternion import from_rotation
from geoimp_drake.rotations.tuples import (
    ORIGIN,
    UNTURNED,
    Rows,
    attached,
    crossed,
    plus,
    product,
    scaled,
    times,
    turn,
    write_pose,
)
from geoimp_drake.typing import Array

__all__ = ["motion_along", "pose_along"]

_AXIS, _TURNS, _POSITION, _VELOCITY = slice(12, 15), 15, 16, 17


@compilable
def pose_along(path: Array, q: Array) -> Array:
    """Returns the pose X_WE (3, 4) of the frame at the end of a path.

    Args:
        path: the joints on the way (n + 1, 18).
        q: at least all positions [rad, m].
    """
    X_WE = np.empty((3, 4))
    R, p = UNTURNED, ORIGIN
    for j in range(len(path) - 1):
        R, p = attached(R, p, path[j, :12].reshape(3, 4))
        R, p = _moved(R, p, path[j], q[int(path[j, _POSITION])])
    R, p = attached(R, p, path[len(path) - 1, :12].reshape(3, 4))
    write_pose(R, p, X_WE)
    return X_WE


@compilable
def motion_along(path: Array, q: Array, v: Array, dv: Array, motion: Array) -> None:
    """Writes the motion in W of the frame at the end of a path (19,).

    Args:
        path: the joints on the way (n + 1, 18).
        q: at least all positions [rad, m].
        v: all velocities [rad/s, m/s].
        dv: all accelerations [rad/s², m/s²].
        motion: where to write.
    """
    R, p, w, dw, v_P, a_P = UNTURNED, ORIGIN, ORIGIN, ORIGIN, ORIGIN, ORIGIN
    for j in range(len(path)):
        before = p
        R, p = attached(R, p, path[j, :12].reshape(3, 4))
        v_P, a_P = _carried(v_P, a_P, w, dw, before, p)
        if j < len(path) - 1:
            k, before = int(path[j, _VELOCITY]), p
            axis = times(R, xyz(path[j, _AXIS]))
            R, p = _moved(R, p, path[j], q[int(path[j, _POSITION])])
            rate, push = scaled(v[k], axis), scaled(dv[k], axis)
            if path[j, _TURNS] > 0.0:
                dw = plus(dw, plus(push, crossed(w, rate)))
                w = plus(w, rate)
            else:
                v_P, a_P = _carried(v_P, a_P, w, dw, before, p)
                v_P = plus(v_P, rate)
                a_P = plus(a_P, plus(push, scaled(2.0, crossed(w, rate))))
    motion[QUATERNION] = from_rotation(matrix(R[0], R[1], R[2]))
    for start, a in ((4, p), (7, w), (10, v_P), (13, dw), (16, a_P)):
        motion[start], motion[start + 1], motion[start + 2] = a


@compilable
def _moved(R: Rows, p: Row, joint: Array, q: float) -> tuple[Rows, Row]:
    """Returns where F, at R and p, is after its joint has moved."""
    axis = xyz(joint[_AXIS])
    if joint[_TURNS] > 0.0:
        return product(R, turn(axis, q)), p
    return R, plus(p, scaled(q, times(R, axis)))


@compilable
def _carried(v: Row, a: Row, w: Row, dw: Row, P: Row, Q: Row) -> tuple[Row, Row]:
    """Returns velocity and acceleration of the point at Q from those of the one at P."""
    r = plus(Q, scaled(-1.0, P))
    u = crossed(w, r)
    return plus(v, u), plus(a, plus(crossed(dw, r), crossed(w, u)))
