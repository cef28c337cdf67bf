"""The whole admittance controller of one position-controlled arm, as one part."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.inverse_kinematics import InverseKinematics
from geoimp_drake.parts.part import Memory, Now, Output, nested
from geoimp_drake.parts.passivity import Passivity
from geoimp_drake.parts.within import Within
from geoimp_drake.parts.wrist_sensors import WristSensors
from geoimp_drake.typing import Array

__all__ = ["AdmittanceController"]


class AdmittanceController:
    """Makes an arm on joint servos compliant: `ImpedanceIntegrator` and `InverseKinematics`.

    Args:
        impedance: of the end effector.
        kinematics: makes the joint references with which E follows C.
        sensor: the wrist sensor; None if the wrench is an input.
        passivity: what changes of the gains pass through; by default they pass unchanged.

    Raises:
        SignalError: an input is NaN or infinite, a quaternion is not unit, or C has diverged.
        SingularityError: the attitude leaves the domain of the orientation family.
    """

    def __init__(
        self,
        impedance: Impedance,
        kinematics: InverseKinematics,
        sensor: WristSensors | None = None,
        passivity: Passivity | None = None,
    ):
        self._impedance, self._kinematics, self._sensor = impedance, kinematics, sensor
        self._passivity = passivity = passivity or Passivity()
        self.inputs: dict[str, Any] = {
            "estimated_state": 2 * kinematics.model.num_joints,
            "desired_motion": FRAME_MOTION_SIZE,
            **({"wrench": 6} if sensor is None else {}),
            **passivity.inputs,
        }
        of = "state", "memory", *self.inputs
        self.inputs |= {} if sensor is None else sensor.plant_inputs
        self.state = impedance.state
        self.memory = Memory(
            kinematics=kinematics.memory,
            impedance=impedance.memory,
            sensor=Memory() if sensor is None else sensor.memory,
            passivity=passivity.memory,
        )
        self._slack = nested(self.memory.kinematics, kinematics.slack)
        self._last = nested(self.memory.impedance, impedance.memory.last)
        self.samplings = [(kinematics.period, self._sample)]
        motion, *others = impedance.outputs
        self.outputs: list[Output] = [
            *(
                output.within(self._of_kinematics, self.inputs)
                for output in kinematics.outputs
                if output.name != "slack"
            ),
            replace(motion, write=self._write_motion, of=of),
            *(
                replace(output, write=self._written_by(output), of=_of(output, of))
                for output in others
            ),
            *passivity.outputs(self.memory.passivity),
        ]
        if sensor is not None:
            self._sensed = nested(self.memory.sensor, sensor.wrenches[0])
            self.samplings.append((sensor.period, self._sense))
            self.outputs += [
                output.within(self._of_sensor, self.inputs) for output in sensor.outputs
            ]

    def new_workspace(self) -> Any:
        """Returns a list with the workspace of the sensor, or with None."""
        return [None if self._sensor is None else self._sensor.new_workspace()]

    def start(self, memory: Array, now: Now) -> None:
        """Takes the measured posture as the first reference, and the requested gains."""
        self._kinematics.start(memory[self.memory.kinematics], now)
        self._passivity.start(memory[self.memory.passivity], now)
        if self._sensor is not None:
            self._sensor.start(memory[self.memory.sensor], now)

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Starts C, or normalizes its quaternion; holds C back by what the limits leave undone.

        It also changes the gains for the step that begins.
        """
        motion, slack = now.output("compliant_motion"), now.memory[self._slack]
        view = self._of_impedance(now)
        self._impedance.keep(memory[self.memory.impedance], state, view, motion, slack)
        place = memory[self.memory.passivity]
        measured = view["wrench"], view["measured_motion"]
        self._passivity.keep(place, now, motion, lambda: measured)

    def rate(self, now: Now, rate: Array) -> None:
        """Writes the derivative of C's state."""
        self._impedance.rate(self._of_impedance(now), rate)

    def _sample(self, memory: Array, now: Now) -> None:
        motion = now.output("compliant_motion")
        self._kinematics.advance(memory[self.memory.kinematics], now, motion)

    def _sense(self, memory: Array, now: Now) -> None:
        if self._sensor is not None:
            self._sensor.take(memory[self.memory.sensor], now, 0, [memory[self._last]])

    def _of_kinematics(self, now: Now) -> Within:
        return Within(now, {}, {}, now.memory[self.memory.kinematics])

    def _of_impedance(self, now: Now) -> Within:
        memory = now.memory
        given = {"measured_motion": self._kinematics.motion(now)}
        if self._sensor is not None:
            given["wrench"] = memory[self._sensed]
        names = {"measured_motion": "estimated_state"}
        view = self._passivity.view(memory[self.memory.passivity], now)
        return Within(view, names, given, memory[self.memory.impedance], now.state)

    def _of_sensor(self, now: Now) -> Within:
        """Returns the sensor's inputs; the plant's last step followed the last motion of C."""
        memory = now.memory
        return Within(now, {}, {"reference_motion": memory[self._last]}, memory[self.memory.sensor])

    def _write_motion(self, now: Now, motion: Array) -> None:
        self._impedance.find(self._of_impedance(now), motion)

    def _written_by(self, output: Output) -> Callable[[Now, Array], None]:
        return lambda now, value: output.write(self._of_impedance(now), value)


def _of(output: Output, everything: Sequence[str]) -> Sequence[str]:
    """Returns what an output of the impedance depends on in the whole controller."""
    return output.of if tuple(output.of) == ("memory",) else everything
