"""One signal carries a whole frame motion, a vector of 19: "replace d by c" is one wire.

The order is unit quaternion [w, x, y, z], position p, angular velocity ω, linear velocity v,
angular acceleration ω̇ and linear acceleration v̇. All are of the frame in W, expressed in W.
"""

import numpy as np
from pydrake.common.containers import namedview
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import BasicVector

from geoimp_drake.laws.frame_motion import (
    ACCELERATION,
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    FRAME_STATE_SIZE,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSE_SIZE,
    POSITION,
    QUATERNION,
    VELOCITY,
)
from geoimp_drake.rotations import quaternion
from geoimp_drake.typing import Array

__all__ = [
    "ACCELERATION",
    "ANGULAR_ACCELERATION",
    "ANGULAR_VELOCITY",
    "FRAME_MOTION_SIZE",
    "FRAME_STATE_SIZE",
    "LINEAR_ACCELERATION",
    "LINEAR_VELOCITY",
    "POSE_SIZE",
    "POSITION",
    "QUATERNION",
    "VELOCITY",
    "FrameMotion",
    "frame_motion_at_rest",
    "frame_motion_vector",
    "pose_of",
]

FrameMotion = namedview(
    "FrameMotion",
    [f"quaternion_{c}" for c in "wxyz"]
    + [f"position_{c}" for c in "xyz"]
    + [f"angular_velocity_{c}" for c in "xyz"]
    + [f"linear_velocity_{c}" for c in "xyz"]
    + [f"angular_acceleration_{c}" for c in "xyz"]
    + [f"linear_acceleration_{c}" for c in "xyz"],
)


def frame_motion_vector() -> BasicVector:
    """Returns a model value for a port that carries a frame motion: at rest at W's origin."""
    return BasicVector(frame_motion_at_rest(RigidTransform()))


def frame_motion_at_rest(X_WF: RigidTransform) -> Array:
    """Returns the motion of a frame F that rests at pose X_WF."""
    motion = np.zeros(FRAME_MOTION_SIZE)
    motion[QUATERNION] = quaternion.from_rotation(X_WF.rotation().matrix())
    motion[POSITION] = X_WF.translation()
    return motion


def pose_of(motion: Array) -> RigidTransform:
    """Returns the pose X_WF of a frame motion."""
    R_WF = RotationMatrix(quaternion.to_rotation(motion[QUATERNION]))
    return RigidTransform(R_WF, motion[POSITION])
