"""Driving an arm through its own interface: status, wrench, supervision, command, tick by tick."""

import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.compilation.compiled import bound
from geoimp_drake.controllers.admittance_controller import AdmittanceLoop, JointReference
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.controllers.observer_checks import warn_of_late_torque
from geoimp_drake.errors import ConfigurationError, GeoimpError
from geoimp_drake.laws.compositions.momentum_observation import external_wrench
from geoimp_drake.parts.momentum_observer import MomentumObserver, MomentumObserverConfig
from geoimp_drake.parts.part_loop import PartLoop
from geoimp_drake.parts.supervisor import Mode, Stop, Supervisor, SupervisorConfig
from geoimp_drake.robots.drive_checks import check_fit, check_status, check_wrench, is_finite_status
from geoimp_drake.robots.drive_log import DriveLog, TickLog
from geoimp_drake.robots.robot_arm import RobotArm, RobotError, RobotStatus
from geoimp_drake.simulation.garbage import only_new_garbage
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, choice, finite_vector, key, positive

__all__ = ["WRENCHES", "Drive", "DriveConfig", "command_of"]

# The sources of the wrench at E.
WRENCHES = ("observer", "robot", "none")

# Least share of a period by which the supervisor's time moves on at each tick.
_LEAST = 0.1

_NO, _YES = np.zeros(1), np.ones(1)


class _Motion(Protocol):
    """A desired motion, such as `DesiredMotion`."""

    def evaluate(self, time: float) -> Array:
        """Returns the motion of D (19) at a time [s]."""


@dataclass
class DriveConfig:
    """How an arm is driven."""

    # The wrench at E: observer, robot (as it reports it) or none; null for the first.
    wrench: str | None = None
    observer: MomentumObserverConfig = field(default_factory=MomentumObserverConfig)
    supervisor: SupervisorConfig = field(default_factory=SupervisorConfig)
    keep: float = 10.0  # the log keeps every tick of the last so many seconds [s]
    log_period: float = 0.01  # of the log of the whole drive [s]
    # Subtracted from the robot's wrench, [moment; force] in E; `geoimp tare --wrist` finds it.
    wrench_bias: Array = field(default_factory=lambda: np.zeros(6))

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        if self.wrench is not None:
            choice(self.wrench, key(name, "wrench"), WRENCHES)
        finite_vector(self.wrench_bias, key(name, "wrench_bias"), 6)
        if np.any(self.wrench_bias) and self.wrench != "robot":
            raise ConfigurationError(
                f"{key(name, 'wrench_bias')} is of the wrench that the robot reports, and "
                f"{key(name, 'wrench')} is {self.wrench or 'not given'}: give robot, or no bias."
            )
        positive(self.keep, key(name, "keep"), "s")
        positive(self.log_period, key(name, "log_period"), "s")


class Drive:
    """Runs a controller on a robot until its desired motion has ended, or something stops it.

    ```
    robot ─status─▶ wrench ─▶ supervisor ─D─▶ control loop ─command─▶ supervisor ─▶ robot
    ```

    A command is torques, or joint positions from an `AdmittanceLoop` for a robot that takes them.

    Args:
        robot: its driver.
        loop: the controller; its joints are in the robot's order.
        config: wrench, supervision and log.

    Raises:
        ConfigurationError: loop and robot do not fit each other.
    """

    def __init__(
        self,
        robot: RobotArm,
        loop: ControlLoop | AdmittanceLoop,
        config: DriveConfig | None = None,
    ):
        self._config = config = config or DriveConfig()
        check(config, "drive")
        check_fit(robot, loop)
        check_wrench(robot, config.wrench)
        self._robot, self._loop = robot, loop
        self._supervisor = PartLoop(_supervisor_of(robot, loop, config.supervisor), robot.name)
        self._observer = None
        if config.wrench in (None, "observer"):
            observer = MomentumObserver(loop.model, config.observer, robot.period)
            self._observer = PartLoop(observer, f"{robot.name} observer")
        self._is_judged = self._observer is None or not robot.real_time
        arm = ChainDynamics(loop.model).arguments
        self._external_wrench = bound(external_wrench, *arm, loop.model.state_order)

    def look(self) -> RobotStatus:
        """Connects and returns a status; it commands nothing.

        If torques that act a tick late would make the arm unstable here, a warning says so once.

        Raises:
            RobotError: the robot does not answer, or is not of this arm.
        """
        loop = self._loop
        status = check_status(self._robot.connect(), self._robot, loop)
        if not self._is_judged:
            self._is_judged = True
            q = loop.joints.from_base(status.q)
            warn_of_late_torque(loop.model, q, loop.config, self._config.observer)
        return status

    def run(self, motion: _Motion, duration: float) -> DriveLog:
        """Drives the robot; returns the log, whatever ended the drive.

        Args:
            motion: of D; it begins when the commands have faded in.
            duration: after which D has ended and the arm is stopped [s].

        Raises:
            RobotError: the robot does not answer.
        """
        self._motion, self._duration = motion, duration
        config = self._config
        times = config.keep, config.log_period, self._robot.period
        self._log = TickLog(*times, len(self._robot.joints))
        self._rehearse(self.look())
        self._robot.start()
        failure = None
        try:
            self._begin(self._first_status())
            with self._stopped_by_interrupt(), only_new_garbage():
                while self._mode() is not Mode.STOPPED:
                    self._tick(self._robot.read())
        except GeoimpError as error:
            failure = error
        finally:
            self._robot.stop()
        return replace(self._log.read(), failure=failure, early=self._early())

    def _early(self) -> RobotError | None:
        """Returns an error if the arm stopped before its motion had ended."""
        if self._clock > self._duration:
            return None
        by = "Ctrl-C" if self._stops else "its supervisor, a warning says why"
        done = f"{self._clock:.3f} s into a motion of {self._duration:g} s"
        return RobotError(f"{self._robot.name}: stopped by {by}, {done}.")

    def _rehearse(self, status: RobotStatus) -> None:
        """Computes ticks whose results are not used: no robot shall wait for a compilation.

        One is an ordinary tick. The other one comes after a gap, which is bridged law by law.
        """
        self._begin(status)
        for ticks in (1, 2):
            self._compute(replace(status, time=self._last + ticks * self._robot.period), _NO)

    def _first_status(self) -> RobotStatus | None:
        """Returns the first status after the start; it may be as late as any later one."""
        end = time.perf_counter() + self._config.supervisor.hold
        status = self._robot.read()
        while status is None and time.perf_counter() < end:
            status = self._robot.read()
        return status

    def _mode(self) -> Mode:
        return Mode(int(self._supervisor.output("mode")[0]))

    def _begin(self, status: RobotStatus | None) -> None:
        status = check_status(status, self._robot, self._loop)
        self._last = self._now = status.time
        self._clock, self._heard = 0.0, time.perf_counter()
        self._sent, self._stops = self._measured(status), False
        D = self._motion.evaluate(0.0)
        command = command_of(self._loop.reset(status.q, status.v, None, D))
        if self._observer is not None:
            self._observer.reset(self._observed(status))
        self._supervisor.reset(
            {
                "desired_motion": D,
                "measured_motion": self._loop.output("measured_motion"),
                "compliant_motion": self._loop.output("compliant_motion"),
                "wrench": np.zeros(6),
                "torque": command,
                "measured_torque": self._measured(status),
                "valid": _NO,
                "stop": _NO,
            }
        )

    def _tick(self, status: RobotStatus | None) -> None:
        begun = time.perf_counter()
        self._note_silence(begun)
        wrench = self._compute(status)
        self._robot.write(self._sent)
        self._keep(status, wrench, time.perf_counter() - begun)

    def _compute(self, status: RobotStatus | None, valid: Array = _YES) -> Array | float:
        """Finds the command; returns the wrench. A status that is not valid starts nothing."""
        supervisor, loop = self._supervisor, self._loop
        elapsed = passed = self._robot.period
        is_new = status is not None and status.time > self._last and is_finite_status(status)
        readings = {"valid": valid if is_new else _NO}
        if status is not None and is_new:
            elapsed, self._last = status.time - self._last, status.time
            # Ticks without a status have already counted, even if the status was only late.
            passed = max(status.time - self._now, _LEAST * passed)
            readings |= {
                "wrench": self._wrench(status, elapsed),
                "measured_torque": self._measured(status),
                "measured_motion": loop.output("measured_motion"),
                "compliant_motion": loop.output("compliant_motion"),
            }
        # A gap in a soft start does not set D in motion.
        if (mode := self._mode()) is Mode.RUN or (mode is Mode.HOLD and self._clock > 0.0):
            self._clock += passed
        self._now += passed
        readings["stop"] = self._stop()
        supervisor.step(readings, {"desired_motion": self._motion.evaluate(self._clock)}, passed)
        if status is not None and is_new:
            D, h = (supervisor.output(f"supervised_{name}") for name in ("motion", "wrench"))
            supervisor.feed({"torque": command_of(loop.step(status.q, status.v, h, D, elapsed))})
        self._sent = supervisor.output("supervised_torque").copy()
        return readings.get("wrench", np.nan)

    def _measured(self, status: RobotStatus) -> Array:
        """Returns the measured torques or positions, whichever the robot takes."""
        return status.torque if self._robot.takes == "torque" else status.q

    def _stop(self) -> Array:
        ended = Stop.ENDED if self._clock > self._duration else Stop.NO
        return np.array([float(Stop.ASKED if self._stops else ended)])

    def _keep(self, status: RobotStatus | None, wrench: Array | float, computing: float) -> None:
        motions = {
            "motion_D": self._supervisor.output("supervised_motion"),
            "motion_C": self._loop.output("compliant_motion"),
            "motion_E": self._loop.output("measured_motion"),
        }
        read: dict[str, Any] = (
            {}
            if status is None
            else {"t": status.time, "q": status.q, "v": status.v, "torque": status.torque}
        )
        for name in ("wrench", "external_torque"):
            if (reported := getattr(status, name, None)) is not None:
                read[f"reported_{name}"] = reported
        mode = self._supervisor.output("mode")
        kept = {**read, self._robot.takes: self._sent, "wrench": wrench, "mode": mode, **motions}
        self._log.append(kept, computing)

    def _note_silence(self, now: float) -> None:
        """Tells the supervisor how long the robot was silent; the robot's clock may not show it."""
        silent, self._heard = now - self._heard, now
        if self._robot.real_time and silent > self._config.supervisor.hold:
            self._supervisor.step({"valid": _NO, "stop": _NO}, {}, silent)

    def _wrench(self, status: RobotStatus, elapsed: float) -> Array:
        if self._observer is not None:
            self._observer.step(self._observed(status), {}, elapsed)
            return self._observer.output("wrench")
        if self._config.wrench == "none":
            return np.zeros(6)
        return self._reported(status)

    def _reported(self, status: RobotStatus) -> Array:
        """Returns the wrench that the robot itself measures, or estimates at its joints."""
        if status.wrench is not None:
            return status.wrench - self._bias(status)
        if status.external_torque is None:
            raise RobotError(
                f"{self._robot.name} reports no wrench; observe it, with wrench: observer."
            )
        h, joints = np.empty(6), self._loop.joints
        reading = joints.reading(status.q, status.v)
        external = joints.from_base(status.external_torque)
        self._external_wrench(reading, external, h)
        return h

    def _bias(self, status: RobotStatus) -> Array:
        """Returns the bias of the reported wrench, in W."""
        if not np.any(bias := self._config.wrench_bias):
            return bias
        R_WE = self._loop.pose(status.q).rotation().matrix()
        return (bias.reshape(2, 3) @ R_WE.T).ravel()

    def _observed(self, status: RobotStatus) -> dict[str, Array]:
        joints = self._loop.joints
        reading, torque = joints.reading(status.q, status.v), joints.actuation(self._sent)
        return {"estimated_state": reading, "torque": torque}

    @contextmanager
    def _stopped_by_interrupt(self) -> Iterator[None]:
        """Lets Ctrl-C brake the arm instead of ending the program."""

        def stop(number: int, frame: object) -> None:
            self._stops = True

        before = signal.signal(signal.SIGINT, stop)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)


def command_of(asked: Array | JointReference) -> Array:
    """Returns the command for a robot: one that takes positions finds their velocities itself."""
    return asked.positions if isinstance(asked, JointReference) else asked


def _supervisor_of(
    robot: RobotArm, loop: ControlLoop | AdmittanceLoop, config: SupervisorConfig
) -> Supervisor:
    """Returns a supervisor that also keeps the robot's own limit; positions have no effort."""
    if robot.takes == "position":
        unlimited = np.full(len(robot.joints), np.inf)
        return Supervisor(unlimited, config, robot.period)
    rate = min(config.limits.torque_rate, robot.torque_rate)
    limits = replace(config.limits, torque_rate=rate)
    return Supervisor(loop.joints.effort_limits, replace(config, limits=limits), robot.period)
