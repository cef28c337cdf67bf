"""Drake's LCM messages of iiwa and Panda, as drake-iiwa-driver and drake-franka-driver use them.

The signs of external torques differ: an iiwa reports the torques that act on its joints, a Panda
those that its joints exert.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from drake import lcmt_iiwa_command, lcmt_iiwa_status, lcmt_panda_command, lcmt_panda_status

from geoimp_drake.robots.robot_arm import RobotStatus
from geoimp_drake.typing import Array

__all__ = ["LCM_MESSAGES", "LcmMessages"]

# Drake's PandaControlMode for torques.
_TORQUE_MODE = 4


@dataclass(frozen=True)
class LcmMessages:
    """Converts a robot's messages, in both directions.

    Attributes:
        status_type: the message that the robot sends.
        command_type: the message that it obeys.
        read_status: from such a message to a status.
        write_status: from a status to such a message.
        read_command: from such a message to torques (n), None if it holds none.
        write_command: from the last status message and torques to a command.
        read_position: from such a message to joint positions (n); None if the robot takes none.
        write_position: from the last status message and joint positions to a command.
    """

    status_type: Any
    command_type: Any
    read_status: Callable[[Any], RobotStatus]
    write_status: Callable[[RobotStatus], Any]
    read_command: Callable[[Any], Array | None]
    write_command: Callable[[Any, Array], Any]
    read_position: Callable[[Any], Array] | None = None
    write_position: Callable[[Any, Array], Any] | None = None


def _read_iiwa_status(message: Any) -> RobotStatus:
    return RobotStatus(
        1e-6 * message.utime,
        np.array(message.joint_position_measured),
        np.array(message.joint_velocity_estimated),
        np.array(message.joint_torque_commanded),
        external_torque=np.array(message.joint_torque_external),
    )


def _write_iiwa_status(status: RobotStatus) -> Any:
    message = lcmt_iiwa_status()
    message.utime, message.num_joints = round(1e6 * status.time), len(status.q)
    message.joint_position_measured = message.joint_position_commanded = status.q.tolist()
    message.joint_position_ipo = status.q.tolist()
    message.joint_velocity_estimated = status.v.tolist()
    message.joint_torque_measured = message.joint_torque_commanded = status.torque.tolist()
    message.joint_torque_external = _external(status).tolist()
    return message


def _read_iiwa_command(message: Any) -> Array | None:
    return np.array(message.joint_torque) if message.num_torques else None


def _write_iiwa_command(status: Any, torque: Array) -> Any:
    command = lcmt_iiwa_command()
    command.utime, command.num_joints = status.utime, status.num_joints
    # In torque mode positions have no stiffness, but the robot still expects its own position.
    command.joint_position = status.joint_position_measured
    command.num_torques, command.joint_torque = len(torque), torque.tolist()
    return command


def _read_iiwa_position(message: Any) -> Array:
    return np.array(message.joint_position)


def _write_iiwa_position(status: Any, position: Array) -> Any:
    command = lcmt_iiwa_command()
    command.utime, command.num_joints = status.utime, status.num_joints
    command.joint_position = position.tolist()
    return command


def _read_panda_status(message: Any) -> RobotStatus:
    return RobotStatus(
        1e-6 * message.utime,
        np.array(message.joint_position),
        np.array(message.joint_velocity),
        np.array(message.joint_torque_desired),
        external_torque=-np.array(message.joint_torque_external),
    )


def _write_panda_status(status: RobotStatus) -> Any:
    message = lcmt_panda_status()
    n, zeros = len(status.q), [0.0] * len(status.q)
    message.utime = message.robot_utime = round(1e6 * status.time)
    message.num_joints, message.control_mode = n, _TORQUE_MODE
    message.joint_position = message.joint_position_desired = status.q.tolist()
    message.joint_velocity = message.joint_velocity_desired = status.v.tolist()
    message.joint_acceleration_desired = zeros
    message.joint_torque = message.joint_torque_desired = status.torque.tolist()
    message.joint_torque_external = (-_external(status)).tolist()
    return message


def _read_panda_command(message: Any) -> Array | None:
    return np.array(message.joint_torque) if message.num_joint_torque else None


def _write_panda_command(status: Any, torque: Array) -> Any:
    command = lcmt_panda_command()
    # The driver lets old commands expire. It compares their time with the clock of its own machine,
    # which it writes into each status. No other machine's clock would do.
    command.utime, command.control_mode_expected = status.utime, _TORQUE_MODE
    command.num_joint_torque, command.joint_torque = len(torque), torque.tolist()
    return command


def _external(status: RobotStatus) -> Array:
    return np.zeros(len(status.q)) if status.external_torque is None else status.external_torque


LCM_MESSAGES = {
    "iiwa": LcmMessages(
        lcmt_iiwa_status,
        lcmt_iiwa_command,
        _read_iiwa_status,
        _write_iiwa_status,
        _read_iiwa_command,
        _write_iiwa_command,
        _read_iiwa_position,
        _write_iiwa_position,
    ),
    "panda": LcmMessages(
        lcmt_panda_status,
        lcmt_panda_command,
        _read_panda_status,
        _write_panda_status,
        _read_panda_command,
        _write_panda_command,
    ),
}
