"""Supervision of an arm under control: started when all is well, braked when it is not, stopped."""

import logging
from collections.abc import Iterator
from enum import IntEnum

import numpy as np

from geoimp_drake.laws.braked_motion import braked_motion
from geoimp_drake.laws.frame_motion import (
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
)
from geoimp_drake.laws.smooth_rest import smooth_step
from geoimp_drake.parts.part import Memory, Now, Output, held
from geoimp_drake.parts.signal_guard import SignalGuard
from geoimp_drake.parts.supervisor_config import SupervisorConfig, SupervisorLimits
from geoimp_drake.typing import Array
from geoimp_drake.validation import check

__all__ = ["Mode", "Stop", "Supervisor", "SupervisorConfig", "SupervisorLimits"]

_log = logging.getLogger("drake")

# Torques as close as this are the same [Nm, N].
_TOLERANCE = 1e-9


class Mode(IntEnum):
    """What a supervised arm is doing."""

    INIT = 0  # no valid reading yet: the robot's own torques
    SOFT_START = 1  # from the robot's torques to the controller's
    RUN = 2
    HOLD = 3  # a signal is missing: the last torques are kept
    BRAKE = 4  # D comes to rest
    STOPPED = 5  # D rests for good


class Stop(IntEnum):
    """Why a supervised arm is to come to rest, at its input `stop`."""

    NO = 0
    ASKED = 1  # somebody wants it
    ENDED = 2  # the desired motion is over


_STOPS = {Stop.ASKED: "asked to stop", Stop.ENDED: "the motion has ended"}

_BLIND = ", D is C"  # ends a reason to brake


class Supervisor:
    """The part of `systems.supervisor.Supervisor`; arguments and errors are the same.

    The motion, the reading and the wrench that it passes on do not depend on the torques. So it may
    stand before and behind a controller at once.
    """

    def __init__(
        self,
        effort_limits: Array,
        config: SupervisorConfig | None = None,
        period: float = 1e-3,
    ):
        config = config or SupervisorConfig()
        check(config, "supervisor")
        n = len(effort_limits)
        self._config, self._effort_limits, self._period = config, effort_limits, period
        self._guard = SignalGuard(n, config.limits, period)
        motions = ("desired_motion", "measured_motion", "compliant_motion")
        self.inputs = {
            **dict.fromkeys(motions, FRAME_MOTION_SIZE),
            "wrench": 6,
            "torque": n,
            "measured_torque": n,
            "valid": 1,
            "stop": 1,
            "estimated_state": 2 * n,
        }
        motion = np.zeros(FRAME_MOTION_SIZE)
        self.memory = Memory(
            mode=float(Mode.INIT),
            since=0.0,  # when the mode began [s]
            seen=0.0,  # when reading and wrench were last valid [s]
            desired=motion,  # D as passed on at the last tick
            held=motion,  # D as braking began
            sent=np.zeros(n),  # the torques of the last tick
            reached=0.0,  # when the torques sent were last those requested, or the mode not RUN [s]
            taken_over=np.zeros(n),  # from which ours fade in: the robot's own, or those held
            held_in=float(Mode.RUN),  # what a missing signal has interrupted
            faded=0.0,  # how much of a soft start had passed then [s]
            guard=self._guard.memory,
        )
        self.samplings = ((period, self.sample),)
        reading = "valid", "estimated_state"
        self.outputs = (
            Output(
                "supervised_motion",
                FRAME_MOTION_SIZE,
                self._write_motion,
                ("memory", "time", "desired_motion"),
            ),
            Output(
                "supervised_torque",
                n,
                self._write_torque,
                ("memory", "time", "torque", "measured_torque", "measured_motion", *reading),
            ),
            Output("supervised_state", 2 * n, self._write_state, ("memory", *reading)),
            Output("supervised_wrench", 6, self._write_wrench, ("memory", "wrench")),
            held("mode", slice(self.memory.mode, self.memory.mode + 1)),
        )

    def sample(self, memory: Array, now: Now) -> None:
        """Checks the signals of a tick, keeps what is sent, and changes the mode with a reason."""
        places = self.memory
        missing = self._guard.missing(now, memory[places.guard])
        if missing is None:
            memory[places.seen] = now.time
        mode = Mode(int(memory[places.mode]))
        verdict = self._verdict(mode, memory, now, missing)
        self._write_torque(now, memory[places.sent], memory)
        if mode is not Mode.RUN or self._reaches(memory[places.sent], now["torque"]):
            memory[places.reached] = now.time
        motion = np.empty(FRAME_MOTION_SIZE)
        self._write_motion(now, motion, memory)
        self._guard.keep(now, memory[places.guard], motion)
        memory[places.desired] = motion
        if verdict is not None:
            self._change(mode, *verdict, memory, now)

    def _verdict(
        self, mode: Mode, memory: Array, now: Now, missing: str | None
    ) -> tuple[Mode, str] | None:
        """Returns the next mode and the reason for it, None to stay."""
        config, elapsed = self._config, now.time - memory[self.memory.since]
        if mode is Mode.INIT:
            return None if missing else (Mode.SOFT_START, "the first valid reading")
        if self._guard.is_blinded(now, memory[self.memory.guard], config.hold):
            return Mode.BRAKE, f"no valid wrench for {1e3 * config.hold:.0f} ms{_BLIND}"
        if mode is Mode.STOPPED:
            return None
        if mode is Mode.BRAKE:
            return (Mode.STOPPED, "D rests") if elapsed >= config.brake else None
        if stop := now["stop"][0]:
            return Mode.BRAKE, _STOPS.get(stop, _STOPS[Stop.ASKED])
        unseen = now.time - memory[self.memory.seen]
        if unseen > config.hold:
            return Mode.BRAKE, f"no {missing or 'valid reading'} for {1e3 * unseen:.0f} ms"
        if missing:
            return None if mode is Mode.HOLD else (Mode.HOLD, f"no {missing}")
        if (excess := self._excess(memory, now)) is not None:
            return Mode.BRAKE, excess
        if mode is Mode.HOLD:
            return Mode(int(memory[self.memory.held_in])), "valid readings again"
        if mode is Mode.SOFT_START and elapsed >= config.soft_start:
            return Mode.RUN, "what is sent has faded in"
        return None

    def _excess(self, memory: Array, now: Now) -> str | None:
        """Returns what exceeds its limit, with both numbers, None for nothing."""
        limits = self._config.limits
        behind = now.time - memory[self.memory.reached]
        if behind > self._config.hold:
            return f"torques that change by {limits.torque_rate:g} Nm/s cannot follow those asked"
        for name, unit, value in self._values(memory, now):
            limit = getattr(limits, name)
            if not value <= limit:
                return f"{name.replace('_', ' ')} {value:.3g} {unit} exceeds {limit:g}"
        return None

    def _reaches(self, sent: Array, asked: Array) -> bool:
        return bool(np.abs(asked - sent).max() <= _TOLERANCE)

    def _values(self, memory: Array, now: Now) -> Iterator[tuple[str, str, float]]:
        """Yields what is limited: name of the limit, unit and value."""
        D, E, C = now["desired_motion"], now["measured_motion"], now["compliant_motion"]
        h, torque, last = now["wrench"], now["torque"], memory[self.memory.desired]
        yield "force", "N", _norm(h[3:])
        yield "moment", "Nm", _norm(h[:3])
        yield "speed", "m/s", _norm(E[LINEAR_VELOCITY])
        yield "turning_speed", "rad/s", _norm(E[ANGULAR_VELOCITY])
        yield "tracking", "m", _norm(C[POSITION] - E[POSITION])
        yield "tracking_turn", "rad", _angle(C[QUATERNION], E[QUATERNION])
        yield "torque", "of the limit", float(np.max(np.abs(torque) / self._effort_limits))
        yield from _steps(D, last)

    def _change(self, mode: Mode, after: Mode, reason: str, memory: Array, now: Now) -> None:
        places = self.memory
        is_unforeseen = after is Mode.BRAKE and reason != _STOPS[Stop.ENDED]
        tell = _log.warning if is_unforeseen else _log.info
        tell(f"{now.system}: t = {now.time:.3f} s: {mode.name} to {after.name}, {reason}.")
        if after is Mode.HOLD:
            memory[places.held_in] = float(mode)
            memory[places.faded] = now.time - memory[places.since]
        memory[places.mode], memory[places.since] = float(after), now.time
        if after is Mode.SOFT_START:
            memory[places.since] -= memory[places.faded]
            memory[places.taken_over] = memory[places.sent]
        if after is Mode.BRAKE:
            # Without a valid wrench D comes to rest from C, so that nothing presses.
            is_blind = reason.endswith(_BLIND)
            memory[places.held] = now["compliant_motion"] if is_blind else memory[places.desired]

    def _write_motion(self, now: Now, motion: Array, memory: Array | None = None) -> None:
        """Writes D, or the motion by which it comes to rest."""
        memory = now.memory if memory is None else memory
        elapsed = now.time - memory[self.memory.since]
        if memory[self.memory.mode] < Mode.BRAKE:
            D, last = now["desired_motion"], memory[self.memory.desired]
            # A jump of D is not passed on, not even for the tick after which D is braked.
            is_under_way = memory[self.memory.mode] > Mode.INIT
            motion[:] = last if is_under_way and self._jumps(D, last) else D
        else:
            is_braking = memory[self.memory.mode] == Mode.BRAKE
            time = elapsed if is_braking else self._config.brake
            motion[:] = braked_motion(time, self._config.brake, memory[self.memory.held])

    def _jumps(self, D: Array, last: Array) -> bool:
        limits = self._config.limits
        return any(not value <= getattr(limits, name) for name, _, value in _steps(D, last))

    def _write_state(self, now: Now, state: Array) -> None:
        self._guard.write_state(now, now.memory[self.memory.guard], state)

    def _write_wrench(self, now: Now, wrench: Array) -> None:
        self._guard.write_wrench(now, now.memory[self.memory.guard], wrench)

    def _write_torque(self, now: Now, torque: Array, memory: Array | None = None) -> None:
        """Writes what is sent: the requested torques, as far as mode and limits allow."""
        memory = now.memory if memory is None else memory
        mode, sent = Mode(int(memory[self.memory.mode])), memory[self.memory.sent]
        wanted = now["torque"]
        if mode is Mode.INIT:
            wanted = now["measured_torque"]
        elif mode is Mode.HOLD or self._guard.missing_reading(now, memory[self.memory.guard]):
            wanted = sent
        elif mode is Mode.SOFT_START:
            wanted = wanted + self._unfaded(memory, now.time) * (
                memory[self.memory.taken_over] - wanted
            )
        if mode is not Mode.INIT:
            change = self._config.limits.torque_rate * self._period
            wanted = np.clip(wanted, sent - change, sent + change)
        torque[:] = wanted

    def _unfaded(self, memory: Array, time: float) -> float:
        """Returns the share that is left of the torques taken over, 1 when a soft start resumes."""
        elapsed, duration = time - memory[self.memory.since], self._config.soft_start
        left, at_first = (
            1.0 - smooth_step(passed, duration)[0]
            for passed in (elapsed, memory[self.memory.faded])
        )
        return float(left / at_first) if left else 0.0


def _steps(D: Array, last: Array) -> Iterator[tuple[str, str, float]]:
    """Yields the changes of D's pose and velocity from one tick to the next, none at the first."""
    if last.any():
        yield "desired_step", "m", _norm(D[POSITION] - last[POSITION])
        yield "desired_step", "rad", _angle(D[QUATERNION], last[QUATERNION])
        yield "desired_speed_step", "m/s", _norm(D[LINEAR_VELOCITY] - last[LINEAR_VELOCITY])
        yield "desired_speed_step", "rad/s", _norm(D[ANGULAR_VELOCITY] - last[ANGULAR_VELOCITY])


def _norm(vector: Array) -> float:
    return float(np.sqrt(vector @ vector))


def _angle(Q_1: Array, Q_2: Array) -> float:
    """Returns the angle between two attitudes [rad]."""
    return 2.0 * float(np.arccos(min(abs(Q_1 @ Q_2), 1.0)))
