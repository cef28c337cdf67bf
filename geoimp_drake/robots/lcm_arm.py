"""An arm behind Drake's LCM messages: iiwa and Panda, as drake-iiwa-driver and -franka-driver."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from drake import lcmt_iiwa_command, lcmt_iiwa_status, lcmt_panda_command, lcmt_panda_status
from pydrake.lcm import DrakeLcm

from geoimp_drake.robots.robot_arm import RobotStatus
from geoimp_drake.typing import Array
from geoimp_drake.validation import choice, positive

__all__ = ["LCM_ROBOTS", "LcmArm"]

LCM_ROBOTS = ("iiwa", "panda")

# Drake's PandaControlMode for torques.
_TORQUE_MODE = 4

# How long a robot may be silent before it counts as absent [s].
_PATIENCE = 2.0


class LcmArm:
    """The driver of an iiwa or a Panda behind Drake's messages; see `RobotArm`.

    The robot itself holds the arm's weight. A status without joints or without a time, which
    Drake's receivers give before the first one, counts as none.

    Args:
        robot: `iiwa` or `panda`.
        url: of LCM; empty for its own default.
        joints: names in the order of the messages.
        period: of the statuses [s].
        channel: what the channels' names begin with; by default IIWA or PANDA.
    """

    gravity = "robot"

    def __init__(
        self,
        robot: str,
        url: str,
        joints: tuple[str, ...],
        period: float = 5e-3,
        channel: str | None = None,
    ):
        choice(robot, "driver.robot", LCM_ROBOTS)
        positive(period, "driver.period", "s")
        self.name, self.joints, self.period = f"{robot} at {url or 'LCM'}", joints, period
        self.torque_rate = np.inf
        self._messages = _MESSAGES[robot]
        prefix = channel or robot.upper()
        self._command, self._status_channel = f"{prefix}_COMMAND", f"{prefix}_STATUS"
        self._lcm = DrakeLcm(url)
        self._newest: Any = None
        self._last: Any = None

    def connect(self) -> RobotStatus | None:
        """See `RobotArm`."""
        if self._newest is None:
            self._lcm.Subscribe(self._status_channel, self._take)
        return self._wait(_PATIENCE)

    def start(self) -> None:
        """See `RobotArm`; the first command takes the torques over."""

    def read(self) -> RobotStatus | None:
        """See `RobotArm`."""
        return self._wait(1.5 * self.period)

    def write(self, torque: Array) -> None:
        """See `RobotArm`."""
        command = self._messages.command(self._last, torque)
        self._lcm.Publish(self._command, command.encode())

    def stop(self) -> None:
        """See `RobotArm`; without commands the robot holds itself."""
        if self._last is not None:
            self.write(np.zeros(len(self.joints)))

    def _take(self, data: bytes) -> None:
        message = self._messages.status_type.decode(data)
        if message.num_joints > 0 and message.utime > 0:
            self._newest = message

    def _wait(self, patience: float) -> RobotStatus | None:
        self._newest = None
        end = time.monotonic() + patience
        while self._newest is None:
            left = end - time.monotonic()
            if left <= 0:
                return None
            self._lcm.HandleSubscriptions(max(1, round(1e3 * left)))
        self._last = self._newest
        return self._messages.status(self._last)


@dataclass(frozen=True)
class _Messages:
    """What messages of a robot mean."""

    status_type: Any
    status: Callable[[Any], RobotStatus]
    command: Callable[[Any, Array], Any]


def _iiwa_status(message: Any) -> RobotStatus:
    return RobotStatus(
        1e-6 * message.utime,
        np.array(message.joint_position_measured),
        np.array(message.joint_velocity_estimated),
        np.array(message.joint_torque_commanded),
        external_torque=np.array(message.joint_torque_external),
    )


def _iiwa_command(status: Any, torque: Array) -> Any:
    command = lcmt_iiwa_command()
    command.utime = status.utime
    # In torque mode the positions have no stiffness; they keep the robot's monitor content.
    command.num_joints, command.joint_position = status.num_joints, status.joint_position_measured
    command.num_torques, command.joint_torque = len(torque), torque.tolist()
    return command


def _panda_status(message: Any) -> RobotStatus:
    return RobotStatus(
        1e-6 * message.utime,
        np.array(message.joint_position),
        np.array(message.joint_velocity),
        np.array(message.joint_torque_desired),
        # Of the arm on its environment.
        external_torque=-np.array(message.joint_torque_external),
    )


def _panda_command(status: Any, torque: Array) -> Any:
    command = lcmt_panda_command()
    # The driver compares it with its own clock, and lets old commands expire.
    command.utime = status.utime
    command.num_joint_torque, command.joint_torque = len(torque), torque.tolist()
    command.control_mode_expected = _TORQUE_MODE
    return command


_MESSAGES = {
    "iiwa": _Messages(lcmt_iiwa_status, _iiwa_status, _iiwa_command),
    "panda": _Messages(lcmt_panda_status, _panda_status, _panda_command),
}
