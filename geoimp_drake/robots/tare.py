"""The load on an arm that its model does not know, from joint torques or wrenches at rest."""

from collections.abc import Iterable, Sequence

import numpy as np
from pydrake.multibody.tree import JacobianWrtVariable

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.robot_joints import RobotJoints
from geoimp_drake.laws.sensing.load_identification import (
    IdentifiedLoad,
    identify_load,
    identify_load_from_joints,
)
from geoimp_drake.robots.robot_arm import RobotArm, RobotError, RobotStatus
from geoimp_drake.typing import Array

__all__ = ["TareReading", "identify_payload", "mean_at_rest", "read_at_rest", "tare_postures"]

# Joints that move faster than this are not at rest [rad/s, m/s].
_AT_REST = 0.02

# The number of first statuses that are not counted, while sensors and filters settle.
_SETTLING = 50

# How far from the first posture the others are [rad, m], and how near to a limit (share of range).
_SPREAD, _MARGIN = 1.0, 0.05

# q (n), and τ_ext (n) in the robot's order, or h at E in W (6).
TareReading = tuple[Array, Array]


def read_at_rest(
    robot: RobotArm, model: ControlModel, samples: int, *, at_wrist: bool = False
) -> TareReading:
    """Returns positions and external torques of a connected robot, means of some statuses.

    If the controller holds the weight, the external torques are what the joints exert beyond the
    weight of the model. What the robot knows of its load does not matter then. Otherwise they are
    the robot's own estimate. At the wrist it is the reported wrench.

    Args:
        robot: connected; nothing is commanded.
        model: the arm with its weight, without the unknown load.
        samples: number of statuses.
        at_wrist: reads the wrench instead of the torques.

    Raises:
        RobotError: the robot does not answer, moves, or reports no external torques, or no wrench.
    """
    statuses = []
    for _ in range(_SETTLING + samples):
        if (status := robot.read()) is None:
            raise RobotError(f"{robot.name} does not answer; its status is needed at rest.")
        statuses.append(status)
    return mean_at_rest(robot, model, statuses[_SETTLING:], at_wrist=at_wrist)


def mean_at_rest(
    robot: RobotArm, model: ControlModel, statuses: Sequence[RobotStatus], *, at_wrist: bool
) -> TareReading:
    """Returns the same as `read_at_rest`, from statuses already read; errors are the same."""
    joints, felt = RobotJoints(model, robot.joints), []
    for status in statuses:
        if (speed := float(np.abs(status.v).max())) > _AT_REST:
            raise RobotError(
                f"{robot.name} moves at {speed:.3g} rad/s; let it rest (at most {_AT_REST:g})."
            )
        felt.append(_wrench(robot, status) if at_wrist else _external(robot, status, joints, model))
    return np.mean([status.q for status in statuses], axis=0), np.mean(felt, axis=0)


def identify_payload(
    robot: RobotArm,
    model: ControlModel,
    readings: Iterable[TareReading],
    *,
    at_wrist: bool = False,
) -> IdentifiedLoad:
    """Returns the load on E beyond the model, and the bias of each joint from base to hand.

    From readings at the wrist, the bias is that of the wrench, in E.

    Args:
        robot: the one that was read.
        model: the arm without the unknown load.
        readings: of `read_at_rest`, in 6 to 10 postures that differ by 1 rad.
        at_wrist: whether they are wrenches.

    Raises:
        ConfigurationError: the postures are too alike; the message has the condition number.
    """
    joints, E, W = RobotJoints(model, robot.joints), model.end_effector, model.world
    context = model.plant.CreateDefaultContext()
    felt, jacobians, attitudes = [], [], []
    for q, external in readings:
        model.plant.SetPositions(context, joints.from_base(q))
        jacobians.append(
            model.plant.CalcJacobianSpatialVelocity(
                context, JacobianWrtVariable.kV, E, np.zeros(3), W, W
            )
        )
        attitudes.append(E.CalcPoseInWorld(context).rotation().matrix())
        if at_wrist:
            felt.append((external.reshape(2, 3) @ attitudes[-1]).ravel())
        else:
            felt.append(joints.from_base(external))
    gravity = model.plant.gravity_field().gravity_vector()
    if at_wrist:
        return identify_load(felt, attitudes, gravity)
    return identify_load_from_joints(felt, jacobians, attitudes, gravity)


def tare_postures(model: ControlModel, first: Array, count: int) -> list[Array]:
    """Returns postures within the limits that tell a load from biases; each is (n), base first.

    Args:
        model: the arm.
        first: the posture near which they lie.
        count: number of postures.
    """
    low, high = model.plant.GetPositionLowerLimits(), model.plant.GetPositionUpperLimits()
    margin = np.where(np.isfinite(high - low), _MARGIN * (high - low), 0.0)
    random = np.random.default_rng(0)
    return [
        np.clip(
            first + _SPREAD * random.uniform(-1.0, 1.0, len(first)), low + margin, high - margin
        )
        for _ in range(count)
    ]


def _wrench(robot: RobotArm, status: RobotStatus) -> Array:
    if status.wrench is None:
        raise RobotError(f"{robot.name} reports no wrench; leave --wrist out to use its joints.")
    return status.wrench


def _external(
    robot: RobotArm, status: RobotStatus, joints: RobotJoints, model: ControlModel
) -> Array:
    if robot.gravity == "robot":
        if status.external_torque is not None:
            return status.external_torque
        raise RobotError(
            f"{robot.name} reports no external torques and holds the weight itself; a load cannot "
            f"be seen at its joints. Use a wrist sensor, with --wrist."
        )
    context = model.plant.CreateDefaultContext()
    model.plant.SetPositions(context, joints.from_base(status.q))
    weight = -model.plant.CalcGravityGeneralizedForces(context)
    own: Array = weight[[model.joint_names.index(name) for name in joints.names]]
    return own - status.torque
