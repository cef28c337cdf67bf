"""The whole controller of two arms that hold one object, as one part."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from geoimp_drake.laws.compositions.object_control import HANDS
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE
from geoimp_drake.parts.found_object import FoundObject
from geoimp_drake.parts.held_object import HeldObject
from geoimp_drake.parts.inner_loop import InnerLoop
from geoimp_drake.parts.joint_limits import slack_of
from geoimp_drake.parts.part import NOTHING, Memory, Now, Output, held, nested
from geoimp_drake.parts.signals import AT_REST
from geoimp_drake.parts.within import Within
from geoimp_drake.parts.wrist_sensors import WristSensors
from geoimp_drake.typing import Array

__all__ = ["TwoArms"]

_ARMS = (1, 2)


class TwoArms:
    """Makes an object that two arms hold compliant: `HeldObject` and an `InnerLoop` for each.

        InnerLoop ── measured motions ─▶ HeldObject ── references ─▶ InnerLoop ─▶ actuation

    Ports, laws and numbers are those of the blocks of `make_cooperative_controller`.

    Args:
        held_object: from hands to their references.
        loops: of both arms; their readings are taken together.
        sensors: of both wrists, in order; None if the wrenches are inputs.

    Raises:
        SignalError: an input is NaN or infinite, a quaternion is not unit, or C has diverged.
        OutOfDomainError: the hands have turned by more than 355° against each other.
        SingularityError: six joints exactly singular without limits, or an attitude leaves the
            domain of an orientation law.
    """

    def __init__(
        self,
        held_object: HeldObject,
        loops: Sequence[InnerLoop],
        sensors: WristSensors | None = None,
    ):
        self._object, self._loops, self._sensors = held_object, loops, sensors
        self.models = [loop.model for loop in loops]
        wrenches = ("wrench_1", "wrench_2") if sensors is None else ()
        self.inputs: dict[str, Any] = {
            **{f"estimated_state_{k}": 2 * loops[k - 1].model.num_joints for k in _ARMS},
            **held_object.inputs,
            **dict.fromkeys(wrenches, 6),
        }
        self.found_of = "state", "memory", "time", *self.inputs
        self.inputs |= {} if sensors is None else sensors.plant_inputs
        self.state = held_object.state
        self.memory = Memory(
            object=held_object.memory,
            arm_1=loops[0].memory,
            arm_2=loops[1].memory,
            # Motions of the hands, held with the readings that they follow from.
            measured_1=AT_REST,
            measured_2=AT_REST,
            sensors=Memory() if sensors is None else sensors.memory,
        )
        self._arms: list[slice] = [self.memory.arm_1, self.memory.arm_2]
        self._measured: list[slice] = [self.memory.measured_1, self.memory.measured_2]
        self._each = list(zip(loops, self._arms, self._measured, strict=True))
        held_places = held_object.memory
        self._followed = [
            nested(self.memory.object, held_places.reference_1),
            nested(self.memory.object, held_places.reference_2),
        ]
        self._sensed = []
        if sensors is not None:
            self._sensed = [nested(self.memory.sensors, place) for place in sensors.wrenches]
        self.samplings = [(loops[0].readings.period, self._read)]
        if sensors is not None:
            self.samplings.append((sensors.period, self._sense))
        self.outputs = [
            *held_object.outputs(self.memory.object),
            *(self._last_references() if sensors is None else ()),
            *(output for k in _ARMS for output in self._outputs_of(k)),
        ]
        if sensors is not None:
            self.outputs += [
                output.within(self._of_sensors, self.inputs) for output in sensors.outputs
            ]

    def _last_references(self) -> list[Output]:
        """Returns outputs for sensors beside the controller."""
        return [held(f"last_reference_motion_{k}", self._followed[k - 1]) for k in _ARMS]

    def _outputs_of(self, k: int) -> list[Output]:
        loop, torque = self._loops[k - 1], partial(self._write_torque, k)
        n, place = loop.model.num_joints, self._arms[k - 1]
        reading = "memory", "estimated_state_1", "estimated_state_2"
        measured = partial(self._write_measured, k)
        return [
            Output(f"actuation_{k}", n, torque, ("found", "time")),
            Output(f"measured_motion_{k}", FRAME_MOTION_SIZE, measured, reading),
            *loop.outputs(place, f"_{k}"),
        ]

    def new_workspace(self) -> list[Any]:
        """Returns the workspaces of both loops, of sensors and object, and arrays for the rate."""
        parts = (*self._loops, self._sensors, self._object)
        places = [None if part is None else part.new_workspace() for part in parts]
        return [*places, self.new_found()]

    def start(self, memory: Array, now: Now) -> None:
        """Takes the first readings of both arms, and the motions of the hands."""
        for loop, arm, measured in self._each:
            loop.start(memory[arm], now)
            loop.write_motion(memory[arm], now, memory[measured])
        if self._sensors is not None:
            self._sensors.start(memory[self.memory.sensors], now)

    def check_start(self, now: Now) -> None:
        """Evaluates the object's law, so that initialization already refuses unusable signals."""
        _ = now.found

    def new_found(self) -> FoundObject:
        """Returns the arrays that the object's law writes to."""
        return self._object.new_found({k: self._loops[k - 1].new_signals() for k in _ARMS})

    def find(self, now: Now, found: FoundObject) -> None:
        """Evaluates the object's law."""
        found.memory = memory = self._remembered(now)
        found.torques.clear()
        first, second = self._measured
        hands = memory[first], memory[second]
        wrenches = self._wrenches(now, memory)
        self._object.find(now, memory[self.memory.object], hands, wrenches, found)

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Starts the object, or normalizes its quaternions; compares torques with the limits.

        It also keeps the effect of the limits on the object and on the mutual pose.
        """
        resolved = [self._resolved(k, now) for k in _ARMS]
        hands = slack_of(resolved[0][-1]), slack_of(resolved[1][-1])
        slacks = self._object.slacks(now, now.found.memory[self.memory.measured_1], hands)
        self._object.keep(memory[self.memory.object], state, now, slacks)
        signals = now.found.arms.values()
        for (loop, arm, _), found, of_arm in zip(self._each, signals, resolved, strict=True):
            loop.compare_with_limits(memory[arm], found, *of_arm, now)

    def rate(self, now: Now, rate: Array) -> None:
        """Writes the derivative of the object's state; a part without impedance follows D."""
        found: FoundObject = now.workspace[4]
        self.find(now, found)
        rate[:] = found.rates
        self._object.hold_back(found.memory[self.memory.object], rate)

    def _read(self, memory: Array, now: Now) -> None:
        *_, watch, found = now.workspace
        for (loop, arm, measured), signals in zip(self._each, found.arms.values(), strict=True):
            loop.sample(memory[arm], now)
            memory[measured] = loop.measured(memory[arm], now, signals)
        # The watch sees the wrenches before this sample, as behind ports.
        place = memory[self.memory.object]
        self._object.sample(place, now, self._wrenches(now, memory), watch)

    def _sense(self, memory: Array, now: Now) -> None:
        if self._sensors is not None:
            place = memory[self.memory.sensors]
            first, second = self._followed
            self._sensors.take(place, now, 2, [memory[first], memory[second]])

    def _remembered(self, now: Now) -> Array:
        """Returns the memory; before the first readings those of the ports pass through."""
        memory = now.memory
        # Both arms have their first readings together.
        if not self._loops[0].has_reading(memory[self._arms[0]]):
            for loop, arm, measured in self._each:
                loop.pass_through(memory[arm], now)
                loop.write_motion(memory[arm], now, memory[measured])
        return memory

    def _wrenches(self, now: Now, memory: Array) -> tuple[Array, Array]:
        if self._sensors is None:
            return now["wrench_1"], now["wrench_2"]
        first, second = self._sensed
        return memory[first], memory[second]

    def _of_sensors(self, now: Now) -> Within:
        """Returns the reference motions that the plant's last step followed, for the sensors."""
        memory = now.memory
        first, second = self._followed
        given = {"reference_motion_1": memory[first], "reference_motion_2": memory[second]}
        return Within(now, {}, given, memory[self.memory.sensors], place=2)

    def _write_torque(self, k: int, now: Now, u: Array) -> None:
        self._resolved(k, now)
        memory = now.memory[self._arms[k - 1]]
        u[:] = self._loops[k - 1].actuation(memory, now.found.arms[k])

    def _resolved(self, k: int, now: Now) -> tuple[float, Array]:
        """Finds the torques of arm k at this time; returns the bound for K_n and `Limited`."""
        found: FoundObject = now.found
        time, bound, limited = found.torques.get(k, (np.nan, 0.0, NOTHING))
        if time != now.time:
            signals, arm = found.arms[k], found.memory[self._arms[k - 1]]
            signals.reference[:] = found.motions[HANDS.start + k - 1]
            signals.wrench[:] = found.hand_wrenches[k - 1]
            *_, bound, limited = self._loops[k - 1].write_torque(now, arm, signals)
            found.torques[k] = now.time, bound, limited
        return bound, limited

    def _write_measured(self, k: int, now: Now, motion: Array) -> None:
        motion[:] = self._remembered(now)[self._measured[k - 1]]
