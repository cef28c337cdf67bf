"""The true motion of a frame, read from a plant: for logs and figures, not for controllers."""

from functools import partial

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialAcceleration, SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame
from pydrake.systems.framework import BasicVector, Context

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.dynamics.path_motion import motion_along
from geoimp_drake.laws.sensing.sensed_wrench import inertial_acceleration
from geoimp_drake.rotations.so3 import cross
from geoimp_drake.systems.frame_motion import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    frame_motion_at_rest,
    frame_motion_vector,
)
from geoimp_drake.systems.part_system import Block
from geoimp_drake.typing import Array

__all__ = ["FrameMotionSensor"]


class FrameMotionSensor(Block):
    """Reads pose, velocity and acceleration of a frame fixed in a body from the plant's ports.

    With sampled output ports a plant's accelerations are those of its last step, and zero before
    the first one.

    With a path to the frame it reads only the motion of the joints (laws/path_motion.py). In Python
    the plant's lists of all bodies cost ten times as much.

    Args:
        frame: F, fixed in a body of a finalized plant.
        path: to F, see `kinematic_tree.path_to`; None takes the lists.

    Ports:
        input body_poses: the plant's body poses, list of RigidTransform
        input body_spatial_velocities: list of SpatialVelocity
        input body_spatial_accelerations: list of SpatialAcceleration
        input state: [q; v] of the plant, read instead of the lists (2n)
        input generalized_acceleration: of the plant, read with it (n)
        output motion: of F in W (19)

        Without a path there are no ports `state` and `generalized_acceleration`.
    """

    def __init__(self, frame: Frame, path: Array | None = None):
        super().__init__()
        self._body = int(frame.body().index())
        self._X_BF = frame.GetFixedPoseInBodyFrame()
        self._law = compiled(motion_along)
        plant: MultibodyPlant = frame.GetParentPlant()
        self._num_positions = plant.num_positions()
        kinds = (RigidTransform, SpatialVelocity, SpatialAcceleration)
        names = ("body_poses", "body_spatial_velocities", "body_spatial_accelerations")
        self._lists = [
            self.DeclareAbstractInputPort(name, AbstractValue.Make([kind()]))
            for name, kind in zip(names, kinds, strict=True)
        ]
        if path is not None:
            n = plant.num_velocities()
            self._state = self.DeclareVectorInputPort("state", self._num_positions + n)
            self._acceleration = self.DeclareVectorInputPort("generalized_acceleration", n)
        self.DeclareVectorOutputPort(
            "motion",
            frame_motion_vector(),
            self._calc_motion if path is None else partial(self._calc_motion_along, path),
        )

    def _calc_motion_along(self, path: Array, context: Context, output: BasicVector) -> None:
        state, dv = self._state.Eval(context), self._acceleration.Eval(context)
        q, v = state[: self._num_positions], state[self._num_positions :]
        self._law(path, q, v, dv, output.get_mutable_value())

    def _calc_motion(self, context: Context, output: BasicVector) -> None:
        X_WB, V_WB, A_WB = (port.Eval(context)[self._body] for port in self._lists)
        p_BF_W = X_WB.rotation() @ self._X_BF.translation()
        w, dw = V_WB.rotational(), A_WB.rotational()
        motion = frame_motion_at_rest(X_WB @ self._X_BF)
        motion[ANGULAR_VELOCITY] = w
        motion[LINEAR_VELOCITY] = V_WB.translational() + cross(w, p_BF_W)
        motion[ANGULAR_ACCELERATION] = dw
        motion[LINEAR_ACCELERATION] = inertial_acceleration(A_WB.translational(), w, dw, p_BF_W)
        output.SetFromVector(np.asarray(motion))
