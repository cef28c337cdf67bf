"""The true motion of a frame, read from a plant: for logs and figures, not for controllers."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialAcceleration, SpatialVelocity
from pydrake.multibody.tree import Frame
from pydrake.systems.framework import BasicVector, Context

from geoimp_drake.laws.sensed_wrench import inertial_acceleration
from geoimp_drake.rotations.so3 import cross
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.frame_motion import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    frame_motion_at_rest,
    frame_motion_vector,
)

__all__ = ["FrameMotionSensor"]


class FrameMotionSensor(Block):
    """Reads pose, velocity and acceleration of a frame fixed in a body from the plant's ports.

    With sampled output ports a plant's accelerations are those of its last step, and zero before
    the first one.

    Args:
        frame: F, fixed in a body of a finalized plant.

    Ports:
        input body_poses: the plant's body poses, list of RigidTransform
        input body_spatial_velocities: list of SpatialVelocity
        input body_spatial_accelerations: list of SpatialAcceleration
        output motion: of F in W (19)
    """

    PLANT_PORTS = ("body_poses", "body_spatial_velocities", "body_spatial_accelerations")

    def __init__(self, frame: Frame):
        super().__init__()
        self._body = int(frame.body().index())
        self._X_BF = frame.GetFixedPoseInBodyFrame()
        kinds = (RigidTransform, SpatialVelocity, SpatialAcceleration)
        for name, kind in zip(self.PLANT_PORTS, kinds, strict=True):
            self.DeclareAbstractInputPort(name, AbstractValue.Make([kind()]))
        self.DeclareVectorOutputPort("motion", frame_motion_vector(), self._calc_motion)

    def _calc_motion(self, context: Context, output: BasicVector) -> None:
        X_WB, V_WB, A_WB = (
            self.GetInputPort(name).Eval(context)[self._body] for name in self.PLANT_PORTS
        )
        p_BF_W = X_WB.rotation() @ self._X_BF.translation()
        w, dw = V_WB.rotational(), A_WB.rotational()
        motion = frame_motion_at_rest(X_WB @ self._X_BF)
        motion[ANGULAR_VELOCITY] = w
        motion[LINEAR_VELOCITY] = V_WB.translational() + cross(w, p_BF_W)
        motion[ANGULAR_ACCELERATION] = dw
        motion[LINEAR_ACCELERATION] = inertial_acceleration(A_WB.translational(), w, dw, p_BF_W)
        output.SetFromVector(np.asarray(motion))
