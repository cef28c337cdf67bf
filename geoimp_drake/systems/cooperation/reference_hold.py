"""Both hands come to rest when a grasp has opened, and then do what the user has chosen."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from geoimp_drake.laws.smooth_rest import smooth_step, stopped
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.frame_motion import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
    check_frame_motion,
    frame_motion_vector,
)
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, choice, key, non_negative, positive

__all__ = [
    "AFTER_HOLD",
    "NOTHING_HELD",
    "ReferenceHold",
    "ReferenceHoldConfig",
    "is_held",
    "is_hold_due",
]

AFTER_HOLD = ("hold", "release", "retreat")

# Both references at the hold, whether there has been one, and its time [s].
NOTHING_HELD = np.zeros(2 * FRAME_MOTION_SIZE + 2)


@dataclass
class ReferenceHoldConfig:
    """How the hands stop and what comes after."""

    after: str = "hold"  # or release, retreat
    stop_time: float = 0.02  # time constant of the velocities [s]
    delay: float = 1.0  # from the hold to release or retreat [s]
    retreat_distance: float = 0.05  # of an opened hand, away from the other [m]
    retreat_duration: float = 2.0  # [s]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        choice(self.after, key(name, "after"), AFTER_HOLD)
        positive(self.stop_time, key(name, "stop_time"), "s")
        non_negative(self.delay, key(name, "delay"), "s")
        positive(self.retreat_distance, key(name, "retreat_distance"), "m")
        positive(self.retreat_duration, key(name, "retreat_duration"), "s")


class ReferenceHold(Block):
    """Passes two reference motions on until a grasp opens; from then on they rest.

    At the first sample at which `opened` is set, the references are taken; their velocities then
    decay with the time constant T of the stop, v(t) = v exp(−t/T), angular velocity likewise. After
    `delay` follows one of

        hold      both hands stay.
        release   both hands stay, and the output `release` asks every hand that still holds the
                  object to open its gripper.
        retreat   every hand whose grasp has opened draws back from the other hand by
                  `retreat_distance`, along the line between the references at the hold, with a
                  fifth-order polynomial in `retreat_duration`; a hand that holds the object stays.

    This lasts until the simulator is initialized again.

    Args:
        config: stop and what comes after.
        period: sampling period [s].

    Raises:
        ConfigurationError: a field cannot be used.
        SignalError: a reference is NaN or infinite, or its quaternion is not unit.

    Ports:
        input reference_motion_1: of the first hand in W (19)
        input reference_motion_2: of the second (19)
        input opened: of `GraspMonitor` (3)
        output held_motion_1: of the first hand in W (19)
        output held_motion_2: of the second (19)
        output release: 1 for a hand that is to open its gripper, else 0 (2)
    """

    def __init__(self, config: ReferenceHoldConfig | None = None, period: float = 1e-3):
        super().__init__()
        self._config = config or ReferenceHoldConfig()
        check(self._config, "opened")
        positive(period, "sampling.period", "s")
        self._references = [
            self.DeclareVectorInputPort(f"reference_motion_{k}", frame_motion_vector())
            for k in (1, 2)
        ]
        self._opened = self.DeclareVectorInputPort("opened", 3)
        self._held = self.declare_state(NOTHING_HELD)
        opened = self.input_port_ticket(self._opened.get_index())
        for k, port in enumerate(self._references):
            self.DeclareVectorOutputPort(
                f"held_motion_{k + 1}",
                frame_motion_vector(),
                lambda context, output, k=k: output.SetFromVector(self._passed(context, k)),
                {
                    self.ticket_of_state(self._held),
                    self.time_ticket(),
                    self.input_port_ticket(port.get_index()),
                    opened,
                },
            )
        self.DeclareVectorOutputPort(
            "release",
            2,
            self._calc_release,
            {self.ticket_of_state(self._held), self.time_ticket(), opened},
        )
        self.DeclareInitializationDiscreteUpdateEvent(self._reset)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._hold_if_opened)

    def _reset(self, context: Context, state: DiscreteValues) -> None:
        state.set_value(self._held, NOTHING_HELD)

    def _hold_if_opened(self, context: Context, state: DiscreteValues) -> None:
        held = state.get_mutable_value(self._held)
        if is_hold_due(held, self._opened.Eval(context)):
            references = [port.Eval(context) for port in self._references]
            self.take(self.get_name(), references, context.get_time(), held)

    def _passed(self, context: Context, k: int) -> Array:
        held = context.get_discrete_state(self._held).value()
        if not is_held(held):
            return self._references[k].Eval(context)
        return self.motion(k, held, context.get_time(), self._opened.Eval(context))

    def _calc_release(self, context: Context, output: BasicVector) -> None:
        held = context.get_discrete_state(self._held).value()
        opened = self._opened.Eval(context)
        output.SetFromVector(self.release(held, context.get_time(), opened))

    def take(self, system: str, references: Sequence[Array], time: float, held: Array) -> None:
        """Holds both references from now on.

        Args:
            system: the name in the error.
            references: of both hands (19).
            time: of the hold [s].
            held: where to write (40), see `NOTHING_HELD`.

        Raises:
            SignalError: a reference is NaN or infinite, or its quaternion is not unit.
        """
        for k, reference in enumerate(references, 1):
            check_frame_motion(reference, f"{system}:reference_motion_{k}")
        held[:] = np.concatenate((*references, [1.0, time]))

    def motion(self, k: int, held: Array, time: float, opened: Array) -> Array:
        """Returns the motion (19) of a hand after the hold.

        Args:
            k: 0 for the first hand, 1 for the second.
            held: what was held (40).
            time: [s].
            opened: of `GraspMonitor` (3).
        """
        starts, elapsed = held[:-2].reshape(2, FRAME_MOTION_SIZE), time - held[-1]
        motion = _stopped_motion(starts[k], elapsed, self._config.stop_time)
        if self._config.after == "retreat" and opened[k]:
            self._retreat(motion, starts[k][POSITION] - starts[1 - k][POSITION], elapsed)
        return motion

    def _retreat(self, motion: Array, p_other_W: Array, elapsed: float) -> None:
        """Adds the retreat along `p_other_W`, from the other hand to this one."""
        way = p_other_W * (self._config.retreat_distance / np.sqrt(p_other_W @ p_other_W))
        step = smooth_step(elapsed - self._config.delay, self._config.retreat_duration)
        for part, s in zip((POSITION, LINEAR_VELOCITY, LINEAR_ACCELERATION), step, strict=True):
            motion[part] += s * way

    def release(self, held: Array, time: float, opened: Array) -> Array:
        """Returns 1 for a hand that is to open its gripper, else 0 (2).

        Args:
            held: what was held (40).
            time: [s].
            opened: of `GraspMonitor` (3).
        """
        due = is_held(held) and time - held[-1] >= self._config.delay
        asked = due and self._config.after == "release"
        return (1.0 - opened[:2]) * float(asked)


def is_held(held: Array) -> bool:
    """Whether there has been a hold.

    Args:
        held: see `NOTHING_HELD` (40).
    """
    return bool(held[-2])


def is_hold_due(held: Array, opened: Array) -> bool:
    """Whether a grasp has opened and there has been no hold.

    Args:
        held: see `NOTHING_HELD` (40).
        opened: of `GraspMonitor` (3).
    """
    return bool(opened[0] or opened[1]) and not is_held(held)


def _stopped_motion(held: Array, elapsed: float, time_constant: float) -> Array:
    """Returns the motion (19) that starts with the pose and velocity of `held` and stops."""
    turn, w, dw = stopped(held[ANGULAR_VELOCITY], elapsed, time_constant)
    way, v, dv = stopped(held[LINEAR_VELOCITY], elapsed, time_constant)
    motion = np.empty(FRAME_MOTION_SIZE)
    motion[QUATERNION] = quaternion.product(quaternion.exp(turn), held[QUATERNION])
    motion[POSITION] = held[POSITION] + way
    motion[ANGULAR_VELOCITY], motion[LINEAR_VELOCITY] = w, v
    motion[ANGULAR_ACCELERATION], motion[LINEAR_ACCELERATION] = dw, dv
    return motion
