"""An arm behind Drake's LCM messages, driven or simulated."""

import time
from typing import Any

import numpy as np
from pydrake.lcm import DrakeLcm

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.robots.lcm_messages import LCM_MESSAGES, LcmMessages
from geoimp_drake.robots.plant_arm import PlantArm
from geoimp_drake.robots.robot_arm import TAKES, RobotStatus
from geoimp_drake.typing import Array
from geoimp_drake.validation import choice, positive

__all__ = ["LcmArm", "LcmRobot"]

# How long a robot may be silent before it counts as absent, and how long in periods before a
# status counts as missing [s, 1].
_PATIENCE, _LATE = 2.0, 1.5

# The providers that LCM knows in a URL.
_PROVIDERS = ("udpm", "tcpq", "memq", "file")

# How far a period may be from a multiple of a step, in steps.
_ROUNDING = 1e-6

# A command expires after this time, as in drake-franka-driver [s].
_EXPIRY = 0.1


class LcmArm:
    """The driver of an iiwa or a Panda behind Drake's messages; see `RobotArm`.

    The robot itself compensates gravity. A status without joints or time, which Drake's receivers
    give before the first one, counts as none.

    Args:
        robot: `iiwa` or `panda`.
        url: of LCM; empty for LCM's own default.
        joints: names in the order of the messages.
        period: of the statuses [s].
        channel: prefix of the channels' names; by default IIWA or PANDA.
        patience: after how long a status counts as missing [s]; one and a half periods by default.
        takes: `torque`, or `position`, which an iiwa's messages have.

    Raises:
        ConfigurationError: the robot is unknown or takes no positions, the period is not positive,
            or LCM does not know the URL.
    """

    gravity, real_time = "robot", True
    torque_rate = np.inf

    def __init__(
        self,
        robot: str,
        url: str,
        joints: tuple[str, ...],
        period: float = 5e-3,
        channel: str | None = None,
        patience: float | None = None,
        takes: str = "torque",
    ):
        choice(robot, "robot", LCM_MESSAGES)
        positive(period, "period", "s")
        self._patience = _LATE * period if patience is None else patience
        self.name, self.joints, self.period = f"{robot} at {url or 'LCM'}", joints, period
        self._messages, self._channel = LCM_MESSAGES[robot], channel or robot.upper()
        self.takes, self._write = takes, _of_kind(takes, self._messages)[1]
        self._sent: Array | None = None
        self._lcm, self._is_connected = _lcm(url), False
        self._newest: Any = None
        self._last: Any = None

    def connect(self) -> RobotStatus | None:
        """See `RobotArm`."""
        if not self._is_connected:
            self._lcm.Subscribe(f"{self._channel}_STATUS", self._take)
            self._is_connected = True
        return self._wait(_PATIENCE)

    def start(self) -> None:
        """See `RobotArm`; the first command takes the arm over."""
        # LCM keeps the oldest of the statuses that came while nobody read.
        while self._lcm.HandleSubscriptions(0):
            pass

    def read(self) -> RobotStatus | None:
        """See `RobotArm`."""
        return self._wait(self._patience)

    def write(self, command: Array) -> None:
        """See `RobotArm`."""
        self._sent = command
        message = self._write(self._last, command)
        self._lcm.Publish(f"{self._channel}_COMMAND", message.encode())

    def stop(self) -> None:
        """See `RobotArm`; the robot then holds its weight, or the last positions."""
        if self._sent is not None:
            is_held = self.takes == "position"
            self.write(self._sent if is_held else np.zeros(len(self.joints)))

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
        return self._messages.read_status(self._last)


class LcmRobot:
    """Lets an arm in a plant speak Drake's messages: the other end of `LcmArm`.

    It sends a status each period, with the joint torques of contacts and pushes. Torques act until
    the next command, or for a tenth of a second. Then, and before the first command, the brakes
    hold the arm. Servos hold the last positions, at first those of the start.

    Args:
        arm: in its plant; `gravity` is `robot`. It takes torques, or positions of an iiwa.
        robot: `iiwa` or `panda`.
        url: of LCM; empty for LCM's own default.
        period: of the statuses, a multiple of the plant's step [s].
        channel: prefix of the channels' names; by default IIWA or PANDA.

    Raises:
        ConfigurationError: the robot is unknown, LCM does not know the URL, or the period is no
            multiple of the plant's step.
    """

    def __init__(
        self,
        arm: PlantArm,
        robot: str,
        url: str,
        period: float = 5e-3,
        channel: str | None = None,
    ):
        choice(robot, "robot", LCM_MESSAGES)
        positive(period, "period", "s")
        self._arm, self._ticks = arm, round(period / arm.period)
        if self._ticks < 1 or abs(period / arm.period - self._ticks) > _ROUNDING:
            raise ConfigurationError(
                f"The period of the statuses is {period:g} s; give a multiple of the plant's step, "
                f"{arm.period:g} s."
            )
        self._messages, self._channel = LCM_MESSAGES[robot], channel or robot.upper()
        self._read, self._lcm = _of_kind(arm.takes, self._messages)[0], _lcm(url)
        self._command: Array | None = None
        self._commanded = -np.inf
        self._lcm.Subscribe(f"{self._channel}_COMMAND", self._take)

    def run(self, duration: float, *, in_step: bool = False) -> None:
        """Lets time pass, in real time.

        Args:
            duration: [s].
            in_step: waits for the answer to each status instead, as long as answers come.
        """
        status, begun, is_answered = self._arm.connect(), time.monotonic(), False
        while status.time < duration:
            if self._arm.takes == "torque":
                self._arm.brake(not is_answered and time.monotonic() - self._commanded > _EXPIRY)
            if self._command is not None:
                self._arm.write(self._command)
            for _ in range(self._ticks):
                status = self._arm.read()
            # What waits is read in any case: a robot that is late has no time to listen.
            self._lcm.HandleSubscriptions(0)
            sent = time.monotonic()
            message = self._messages.write_status(status)
            self._lcm.Publish(f"{self._channel}_STATUS", message.encode())
            if is_answered:
                self._listen(sent + _PATIENCE, sent)
                begun = time.monotonic() - status.time
            else:
                self._listen(begun + status.time, np.inf)
            is_answered = in_step and self._commanded > sent

    def _listen(self, until: float, answer: float) -> None:
        """Takes commands until a given instant, or until one arrives after the instant `answer`."""
        while (left := until - time.monotonic()) > 0 and self._commanded < answer:
            self._lcm.HandleSubscriptions(max(1, round(1e3 * left)))

    def _take(self, data: bytes) -> None:
        command = self._read(self._messages.command_type.decode(data))
        if command is not None and len(command) == len(self._arm.joints):
            self._command, self._commanded = command, time.monotonic()


def _of_kind(takes: str, messages: LcmMessages) -> tuple[Any, Any]:
    """Returns the functions that read such a command from a message, and write it to one."""
    choice(takes, "takes", TAKES)
    if takes == "torque":
        return messages.read_command, messages.write_command
    if messages.read_position is None:
        raise ConfigurationError(
            "Positions over LCM are for the messages of an iiwa; these are others. Give messages: "
            "iiwa, or a scheme that gives torques: inner-loop or direct."
        )
    return messages.read_position, messages.write_position


def _lcm(url: str) -> DrakeLcm:
    """Returns LCM at a URL; refuses one that LCM does not know, where LCM would send nothing."""
    if url and url.partition("://")[0] not in _PROVIDERS:
        raise ConfigurationError(
            f"The URL of LCM is '{url}'; give one that begins with "
            f"{', '.join(f'{provider}://' for provider in _PROVIDERS)}, or none for LCM's own."
        )
    return DrakeLcm(url)
