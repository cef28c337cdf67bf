"""Copies of a joint between other frames, and the pose at which a joint is locked."""

import numpy as np
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import Frame, Joint, PrismaticJoint, RevoluteJoint, WeldJoint

from geoimp_drake.errors import ModelError

__all__ = ["check_single_axis", "joint_between", "locked_pose"]


def check_single_axis(joint: Joint) -> None:
    """Raises ModelError if an arm cannot have such a joint."""
    if not isinstance(joint, RevoluteJoint | PrismaticJoint):
        raise ModelError(
            f"Joint '{joint.name()}' is of type '{joint.type_name()}'; an arm is made of revolute "
            f"and prismatic joints. Write it as several of these with links without mass between "
            f"them, as is done to the planar joints of a URDF."
        )


def joint_between(joint: Joint, P: Frame, C: Frame) -> Joint:
    """Returns the same joint between other frames."""
    if isinstance(joint, WeldJoint):
        return WeldJoint(joint.name(), P, C, joint.X_FM())
    check_single_axis(joint)
    revolute = isinstance(joint, RevoluteJoint)
    axis = joint.revolute_axis() if revolute else joint.translation_axis()
    kind = RevoluteJoint if revolute else PrismaticJoint
    copy = kind(joint.name(), P, C, axis, damping=joint.default_damping())
    copy.set_position_limits(joint.position_lower_limits(), joint.position_upper_limits())
    copy.set_velocity_limits(joint.velocity_lower_limits(), joint.velocity_upper_limits())
    copy.set_acceleration_limits(
        joint.acceleration_lower_limits(), joint.acceleration_upper_limits()
    )
    copy.set_default_positions(joint.default_positions())
    return copy


def locked_pose(joint: Joint) -> tuple[RigidTransform, str]:
    """Returns X_PC at the default position, or at the nearest one allowed, and a word on which."""
    if not isinstance(joint, RevoluteJoint | PrismaticJoint):
        raise ModelError(
            f"Joint '{joint.name()}' beside the arm is of type '{joint.type_name()}', which cannot "
            f"be locked; fix it in the file."
        )
    low, high = joint.position_lower_limit(), joint.position_upper_limit()
    q = float(np.clip(joint.default_positions()[0], low, high))
    where = f" at {q:g}" if q else ""
    if isinstance(joint, PrismaticJoint):
        return RigidTransform(q * joint.translation_axis()), where
    return RigidTransform(RotationMatrix(AngleAxis(q, joint.revolute_axis()))), where
