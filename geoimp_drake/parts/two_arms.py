"""The whole controller of two arms that hold one object as one part."""

from collections.abc import Sequence
from functools import partial
from typing import Any

from geoimp_drake.laws.compositions.object_control import HANDS
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE
from geoimp_drake.parts.held_object import FoundObject, HeldObject
from geoimp_drake.parts.inner_loop import InnerLoop
from geoimp_drake.parts.part import Memory, Now, Output, held, nested
from geoimp_drake.parts.signals import AT_REST
from geoimp_drake.parts.within import Within
from geoimp_drake.parts.wrist_sensors import WristSensors
from geoimp_drake.typing import Array

__all__ = ["TwoArms"]

_ARMS = (1, 2)
_ACTUATIONS = ("actuation_1", "actuation_2")


class TwoArms:
    """Makes an object that two arms hold compliant: `HeldObject` and an `InnerLoop` for each.

        InnerLoop ── measured motions ─▶ HeldObject ── references ─▶ InnerLoop ─▶ actuation

    Args:
        held_object: from hands to their references.
        loops: of both arms; their readings are taken together.
        sensors: of both wrists, in order; None if the wrenches are inputs.

    Raises:
        SignalError: an input is NaN or infinite, a quaternion is not unit, or C has diverged.
        OutOfDomainError: the hands have turned by more than 355° against each other.
        SingularityError: six joints in an exactly singular posture, or an attitude leaves the
            domain of an orientation law.

    Ports:
        input estimated_state_1: [q; v] of the first arm of n joints, in the plant's order (2n)
        input estimated_state_2: the same of the second (2n)
        input desired_motion: of D, the object's, in W (19)
        input stiffness_scale: factors of K_p and K_o, one each if not connected (2)
        input wrench_1: h = [μ; f] by the first hand on its environment, about Eo, in W (6)
        input wrench_2: the same by the second (6)
        output compliant_motion: of C, the object's, in W (19)
        output displacement: of D from C: [orientation displacement; Δp_dc] (6)
        output energy: energies and powers of the impedance, `ImpedanceEnergy` (9)
        output object_motion: of O in W as measured (19)
        output object_wrench: by the object on its environment, about Oo, in W (6)
        output internal_wrench: ½(h_2 − h_1), in W (6)
        output mutual_motion: the measured mutual pose, see `CooperativeKinematics` (19)
        output mutual_reference: the grasp's mutual pose ¹Q_21, ᵒΔp_21, at rest (19)
        output reference_motion_1: of the first hand in W (19)
        output reference_motion_2: of the second (19)
        output opened: which grasps have opened, and when, see `GraspMonitor` (3)
        output release: which grippers are to open, see `ReferenceHold` (2)
        output last_reference_motion_1: of the first hand when the last step began (19)
        output last_reference_motion_2: of the second (19)
        output actuation_1: torques in the order of the first arm's actuators (n) [Nm or N]
        output measured_motion_1: of the first hand from the readings; no accelerations (19)
        output peak_effort_1: largest torque so far as a fraction of the limit (n)
        output actuation_2: the same of the second (n)
        output measured_motion_2: the same of the second (19)
        output peak_effort_2: the same of the second (n)

        Without a watch there are no ports `opened` and `release`. With sensors, inputs for the
        plant's outputs (`reaction_forces` and `state`, or what else `ForceTorqueSensors` reads)
        replace `wrench_1` and `wrench_2`, and there are outputs `wrench_1`,
        `wrench_true_1`, `peak_reading_1` and those of the second in the place of
        `last_reference_motion_1` and `_2`.
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
            # Of the hands, held with the readings that they follow from.
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
            held(f"peak_effort_{k}", nested(place, loop.memory.peak)),
        ]

    def new_workspace(self) -> list[Any]:
        """Returns those of both loops and of the sensors."""
        parts = (*self._loops, self._sensors)
        return [None if part is None else part.new_workspace() for part in parts]

    def start(self, memory: Array, now: Now) -> None:
        """Takes the first readings."""
        for loop, arm, measured in self._each:
            loop.start(memory[arm], now)
            loop.write_motion(memory[arm], now, memory[measured])

    def check_start(self, now: Now) -> None:
        """Evaluates the object's law, so that initialization already refuses what it cannot use."""
        _ = now.found

    def new_found(self) -> FoundObject:
        """Returns what the object's law writes to."""
        return FoundObject()

    def find(self, now: Now, found: FoundObject) -> None:
        """Evaluates the object's law."""
        found.memory = memory = self._remembered(now)
        first, second = self._measured
        hands = memory[first], memory[second]
        wrenches = self._wrenches(now, memory)
        self._object.find(now, memory[self.memory.object], hands, wrenches, found)

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Starts the object, or normalizes its quaternions; compares torques with the limits."""
        self._object.begin(memory[self.memory.object], state, now)
        for (loop, arm, _), name in zip(self._each, _ACTUATIONS, strict=True):
            loop.compare_with_limits(memory[arm], now.output(name), now)

    def rate(self, now: Now, rate: Array) -> None:
        """Writes the derivative of the object's state; a part without impedance follows D."""
        found = FoundObject()
        self.find(now, found)
        rate[:] = found.rates

    def _read(self, memory: Array, now: Now) -> None:
        for loop, arm, measured in self._each:
            loop.sample(memory[arm], now)
            loop.write_motion(memory[arm], now, memory[measured])
        # The watch sees the wrenches before this sample, as behind ports.
        place = memory[self.memory.object]
        self._object.sample(place, now, self._wrenches(now, memory))

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
        found: FoundObject = now.found
        reference, wrench = found.motions[HANDS.start + k - 1], found.hand_wrenches[k - 1]
        arm = found.memory[self._arms[k - 1]]
        self._loops[k - 1].write_torque(now, arm, reference, wrench, u)

    def _write_measured(self, k: int, now: Now, motion: Array) -> None:
        motion[:] = self._remembered(now)[self._measured[k - 1]]
