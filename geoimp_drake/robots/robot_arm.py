"""The interface of a robot arm's driver: it reads a status, and writes torques or positions."""

from dataclasses import dataclass
from typing import Protocol

from geoimp_drake.errors import GeoimpError
from geoimp_drake.typing import Array

__all__ = ["TAKES", "RobotArm", "RobotError", "RobotStatus"]

# The kinds of commands that a robot may take.
TAKES = ("torque", "position")


class RobotError(GeoimpError):
    """A robot does not answer, or reports something impossible."""


@dataclass
class RobotStatus:
    """A robot's report at a tick, in its own order of joints.

    Attributes:
        time: of the robot's clock [s].
        q: joint positions (n) [rad, m].
        v: joint velocities (n).
        torque: exerted by the joints, without gravity compensation if the robot does that itself
            (n) [Nm, N].
        wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6), None if the
            robot measures none.
        external_torque: on the joints, by whatever touches the arm or hangs on it unknown to the
            robot (n); None if not estimated.
    """

    time: float
    q: Array
    v: Array
    torque: Array
    wrench: Array | None = None
    external_torque: Array | None = None


class RobotArm(Protocol):
    """A driver. To write your own, make a class with these names; see `docs/howto/on_a_robot.md`.

    Attributes:
        name: for messages and logs.
        joints: names in the order of status and torques, those of the robot's file.
        period: of a tick [s].
        gravity: who compensates gravity: `robot`, which adds it to the commanded torques, or
            `controller`.
        real_time: whether time passes for the robot while nothing is read or written.
        torque_rate: fastest change of a torque that the robot accepts [Nm/s, N/s].
        takes: kind of its commands: `torque`, or `position` of joints with servos of their own.
    """

    name: str
    joints: tuple[str, ...]
    period: float
    gravity: str
    real_time: bool
    torque_rate: float
    takes: str

    def connect(self) -> RobotStatus | None:
        """Connects; returns a status before anything is commanded, None if there is no answer.

        Raises:
            RobotError: there is no answer, or it is another robot.
        """

    def start(self) -> None:
        """Takes the arm over from the robot's own controller."""

    def read(self) -> RobotStatus | None:
        """Waits for the next status; returns None if there is none for a period and a half."""

    def write(self, command: Array) -> None:
        """Sends the command for the next tick (n), torques [Nm, N] or positions [rad, m]."""

    def stop(self) -> None:
        """Gives the arm back to the robot's own controller, which holds it; closes."""
