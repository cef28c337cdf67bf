"""A Franka arm through its own interface, libfranka."""

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np

from geoimp_drake.extras import needs_extra
from geoimp_drake.robots.robot_arm import RobotError, RobotStatus
from geoimp_drake.typing import Array

__all__ = ["FR3_JOINTS", "FrankaArm"]

FR3_JOINTS = tuple(f"fr3_joint{k}" for k in range(1, 8))

# A peer that accepts the connection and stays silent blocks libfranka, and with it this whole
# program, for ever; Ctrl-C does not work either. So another process asks first, and is ended when
# time is up.
_ASK = """
import sys, pylibfranka
try:
    pylibfranka.Robot(sys.argv[1], pylibfranka.RealtimeConfig.kIgnore).read_once()
except Exception as error:
    sys.exit(" ".join(str(error).split()))
"""


class FrankaArm:
    """The driver of a Franka arm (or of `franky-sim`); see `RobotArm`.

    It commands torques at 1 kHz. The robot itself compensates gravity, and stops by itself if 20
    commands in a row are late. The driver undoes what libfranka does to the scheduler of the thread
    that connects: only `real_time` sets priorities. It needs the extra `franka`.

    Args:
        address: of the robot, a host name or an IP address.
        joints: names in the robot's file, from base to hand; those of an FR3 by default.
        real_time: whether the connection demands a kernel with real-time scheduling, as libfranka
            does by default.
        patience: how long to wait for the robot's first answer [s].

    Attributes:
        success_rate: lowest share of commands that came in time, as the robot counts it.

    Raises:
        ConfigurationError: pylibfranka is not installed.
    """

    period = 1e-3
    gravity, real_time = "robot", True
    torque_rate = 1000.0
    takes = "torque"

    def __init__(
        self,
        address: str,
        joints: tuple[str, ...] = FR3_JOINTS,
        *,
        real_time: bool = False,
        patience: float = 5.0,
    ):
        with needs_extra("franka", "A Franka arm"):
            import pylibfranka
        # In Python these do not derive from FrankaException.
        self._errors = tuple(
            kind for name, kind in vars(pylibfranka).items() if name.endswith("Exception")
        )
        self._library, self._address, self._real_time = pylibfranka, address, real_time
        self._patience = patience
        self.name = f"franka {address}"
        self.joints, self.success_rate = joints, 1.0
        self._robot: Any = None
        self._control: Any = None

    def connect(self) -> RobotStatus:
        """See `RobotArm`."""
        config = self._library.RealtimeConfig
        try:
            if self._robot is None:
                self._ask()
                with _same_scheduler():
                    self._robot = self._library.Robot(
                        self._address, config.kEnforce if self._real_time else config.kIgnore
                    )
            return _status(self._robot.read_once())
        except self._errors as error:
            raise self._error(error) from error

    def start(self) -> None:
        """See `RobotArm`."""
        try:
            self._control = self._robot.start_torque_control()
        except self._errors as error:
            raise self._error(error) from error

    def read(self) -> RobotStatus:
        """See `RobotArm`; libfranka waits for the robot, and ends the connection by itself."""
        try:
            state, _ = self._control.readOnce()
        except self._errors as error:
            raise self._error(error) from error
        self.success_rate = min(self.success_rate, state.control_command_success_rate)
        return _status(state)

    def write(self, torque: Array) -> None:
        """See `RobotArm`."""
        try:
            self._control.writeOnce(self._library.Torques(torque.tolist()))
        except self._errors as error:
            raise self._error(error) from error

    def stop(self) -> None:
        """See `RobotArm`."""
        if self._control is None:
            return
        last = self._library.Torques([0.0] * len(self.joints))
        last.motion_finished = True
        # A robot that is gone, or has stopped by itself, holds its arm itself.
        with contextlib.suppress(*self._errors):
            self._control.writeOnce(last)
        # The robot accepts no second connection while this one is open.
        self._control = self._robot = None

    def _ask(self) -> None:
        """Raises RobotError if the robot does not answer in time."""
        asked = [sys.executable, "-c", _ASK, self._address]
        try:
            ended = subprocess.run(
                asked, stderr=subprocess.PIPE, text=True, timeout=self._patience, check=False
            )
        except subprocess.TimeoutExpired:
            raise RobotError(
                f"{self.name} does not answer within {self._patience:g} s. Is the address right, "
                f"the robot switched on, and its network interface (FCI) active?"
            ) from None
        if ended.returncode:
            raise RobotError(f"{self.name}: {ended.stderr.strip()}")

    def _error(self, error: Exception) -> RobotError:
        return RobotError(f"{self.name}: {' '.join(str(error).split())}")


@contextlib.contextmanager
def _same_scheduler() -> Iterator[None]:
    """Restores the scheduler of this thread, which libfranka leaves at the highest priority."""
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        yield
    finally:
        os.sched_setscheduler(0, *before)


def _status(state: Any) -> RobotStatus:
    external = list(state.tau_ext_hat_filtered)
    return RobotStatus(
        time=state.time.to_sec(),
        q=np.array(state.q),
        v=np.array(state.dq),
        # The commanded torque, since the measured one contains the weight.
        torque=np.array(state.tau_J_d),
        # libfranka's value, measured less expected, is what the joints exert on what touches the
        # arm. `franky-sim` expects nothing and repeats what it measures, which is no estimate.
        external_torque=None if external == list(state.tau_J) else -np.array(external),
    )
