"""Limits for an arm that may hit somebody: D is slowed, leashed to C, and becomes C after a hit."""

import logging
from dataclasses import dataclass

import numpy as np

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.frame_motion import (
    ACCELERATION,
    FRAME_MOTION_SIZE,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSE_SIZE,
    POSITION,
    is_finite,
)
from geoimp_drake.laws.impedance.natural_inertia import mobility
from geoimp_drake.laws.limits.safe_speed import leashed, safe_speed
from geoimp_drake.parts.part import Memory, Now, Output, held
from geoimp_drake.parts.signals import check_frame_motion, check_signal
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, key, positive
from geoimp_drake.validation.values import check_text

__all__ = ["SafetyConfig", "SafetyLimits"]

_log = logging.getLogger("drake")

_LONGEST_SOURCE = 1000
_ROUNDING = 1e-9


@dataclass
class SafetyConfig:
    """The force that an arm may exert on somebody it hits, and how that limit is kept.

    The library has no default for that force: give yours, and its source. This is not a certified
    safety function.
    """

    force: float = 0.0  # largest force of a contact; to be given [N]
    source: str = ""  # of that limit, in words; to be given
    contact_stiffness: float = 0.0  # of the stiffest body that may be hit; to be given [N/m]
    cap: bool = True  # D is not faster than (L.8), at which an impact stays below `force`
    leash: bool = True  # D's spring and damper pull C with half of `force` each, at most (L.9)
    detection: float | None = 15.0  # force at the wrist at which D becomes C; null for none [N]
    softer: float = 0.2  # K is multiplied by this from then on

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        for field in ("force", "contact_stiffness", "softer"):
            positive(getattr(self, field), key(name, field))
        if self.detection is not None:
            positive(self.detection, key(name, "detection"), "N")
        source = key(name, "source")
        check_text(self.source, source, _LONGEST_SOURCE)
        if not self.source.strip():
            raise ConfigurationError(
                f"{source} is empty; say where the limit of {self.force:g} N comes from: a "
                f"standard, its edition and the part of the body, or your own risk assessment."
            )


class SafetyLimits:
    """The part of `systems.safety_limits.SafetyLimits`; arguments and errors are the same."""

    def __init__(
        self,
        model: ControlModel,
        gains: tuple[Array, Array, Array],
        config: SafetyConfig,
        period: float = 1e-3,
    ):
        check(config, "safety")
        self._config, self._period, self._order = config, period, model.state_order
        self._M, self._D, self._K = gains
        self._dynamics = ChainDynamics(model)
        self._speed, self._mobility = compiled(safe_speed), compiled(mobility)
        self._leashed = compiled(leashed)
        self.inputs = {
            "desired_motion": FRAME_MOTION_SIZE,
            "compliant_motion": FRAME_MOTION_SIZE,
            "wrench": 6,
            "estimated_state": 2 * model.num_joints,
        }
        self.memory = Memory(
            motion=np.zeros(FRAME_MOTION_SIZE),  # of D as passed on at the last tick
            is_set=0.0,
            scale=np.ones(2),
            report=np.zeros(3),
        )
        of = "memory", "desired_motion", "compliant_motion", "estimated_state"
        self.outputs = (
            Output("safe_motion", FRAME_MOTION_SIZE, self._write_motion, of),
            held("stiffness_scale", self.memory.scale),
            held("safety", self.memory.report),
        )
        self.samplings = ((period, self.sample),)

    def sample(self, memory: Array, now: Now) -> None:
        """Keeps D as it is passed on; after a hit, D rests where C is and K is lower.

        Raises:
            SignalError: the wrench, a reading or D is not finite, or D's quaternion is not unit.
        """
        places, wrench = self.memory, now["wrench"]
        check_signal(wrench, now.port("wrench"))
        motion = np.empty(FRAME_MOTION_SIZE)
        speed = self._find_motion(now, memory, motion)
        memory[places.motion], memory[places.is_set] = motion, 1.0
        behind = float(np.linalg.norm(now["desired_motion"][POSITION] - motion[POSITION]))
        force, least = float(np.linalg.norm(wrench[3:])), self._config.detection
        if not self._has_reacted(memory) and least is not None and force >= least:
            _log.warning(
                f"{now.system}: t = {now.time:.3f} s: {force:.3g} N at the wrist, not below "
                f"{least:g}; D stays where C is and K is multiplied by {self._config.softer:g}."
            )
            memory[places.scale] = self._config.softer
            memory[places.motion][:POSE_SIZE] = now["compliant_motion"][:POSE_SIZE]
            memory[places.motion][POSE_SIZE:] = 0.0
        memory[places.report] = speed, behind, float(self._has_reacted(memory))

    def _has_reacted(self, memory: Array) -> bool:
        return bool(memory[self.memory.scale][0] != 1.0)

    def _write_motion(self, now: Now, motion: Array) -> None:
        self._find_motion(now, now.memory, motion)

    def _find_motion(self, now: Now, memory: Array, motion: Array) -> float:
        """Writes D as it is passed on; returns the speed that it may have [m/s].

        It is zero after a reaction, and infinite if D rests, without a cap and before the first
        sample.
        """
        motion[:] = now["desired_motion"]
        last, speed = memory[self.memory.motion], np.inf
        if not memory[self.memory.is_set]:
            return speed
        if self._has_reacted(memory):
            motion[:] = last
            return 0.0
        check_frame_motion(motion, now.port("desired_motion"))
        if self._config.cap:
            speed = self._slow(now, last, motion)
        if self._config.leash:
            self._hold(now["compliant_motion"], motion)
        return speed

    def _slow(self, now: Now, last: Array, motion: Array) -> float:
        """Moves D towards where it should be, no faster than is safe; returns that speed."""
        way = motion[POSITION] - last[POSITION]
        length = float(np.sqrt(way @ way))
        if length == 0.0:
            return np.inf
        direction = way / length
        speed = self._safe_speed(now, direction)
        if length > speed * self._period * (1.0 + _ROUNDING):
            motion[LINEAR_VELOCITY] = speed * direction
            motion[POSITION] = last[POSITION] + self._period * motion[LINEAR_VELOCITY]
            motion[LINEAR_ACCELERATION] = 0.0
        return speed

    def _safe_speed(self, now: Now, direction: Array) -> float:
        reading = now["estimated_state"]
        check_signal(reading, now.port("estimated_state"))
        arm = self._dynamics.evaluate(None, reading[self._order])
        G = np.ascontiguousarray(self._mobility(arm.Jv_V_WE, arm.B)[3:, 3:])
        config = self._config
        return float(
            self._speed(direction, config.force, config.contact_stiffness, G, self._M, self._D)
        )

    def _hold(self, C: Array, motion: Array) -> None:
        """(L.9) Limits D's lead on C: spring and damper pull with half of `force` each, at most."""
        if not is_finite(C) or not C[:POSE_SIZE].any():
            return
        half = 0.5 * self._config.force
        for place, gain in ((POSITION, self._K), (LINEAR_VELOCITY, self._D)):
            difference = motion[place] - C[place]
            allowed = self._leashed(difference, gain, half)
            if not np.array_equal(allowed, difference):
                motion[place] = C[place] + allowed
                motion[ACCELERATION] = 0.0
