"""The whole admittance controller of one arm that takes positions as one part."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE
from geoimp_drake.parts.hold_back import NO_SLACK
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.inverse_kinematics import InverseKinematics
from geoimp_drake.parts.part import Memory, Now, Output
from geoimp_drake.parts.within import Within
from geoimp_drake.typing import Array

__all__ = ["AdmittanceController"]


class AdmittanceController:
    """Makes an arm on joint servos compliant: `ImpedanceIntegrator` and `InverseKinematics`.

    Args:
        impedance: of the end effector.
        kinematics: makes the joint references with which E follows C.

    Raises:
        SignalError: an input is NaN or infinite, a quaternion is not unit, or C has diverged.
        SingularityError: the attitude leaves the domain of the orientation family.
    """

    def __init__(self, impedance: Impedance, kinematics: InverseKinematics):
        self._impedance, self._kinematics = impedance, kinematics
        n = kinematics.model.num_joints
        self.inputs = {
            "estimated_state": 2 * n,
            "desired_motion": FRAME_MOTION_SIZE,
            "wrench": 6,
            "stiffness_scale": 2,
        }
        self.state = impedance.state
        self.memory = Memory(kinematics=kinematics.memory, impedance=impedance.memory)
        self.samplings = ((kinematics.period, self._sample),)
        of = "state", "memory", *self.inputs
        motion, *others = impedance.outputs
        self.outputs: Sequence[Output] = (
            *(output.within(self._of_kinematics, self.inputs) for output in kinematics.outputs),
            replace(motion, write=self._write_motion, of=of),
            *(
                replace(output, write=self._written_by(output), of=_of(output, of))
                for output in others
            ),
        )

    def start(self, memory: Array, now: Now) -> None:
        """Takes the measured posture as the first reference."""
        self._kinematics.start(memory[self.memory.kinematics], now)

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Starts C, or normalizes its quaternion."""
        motion = now.output("compliant_motion")
        view = self._of_impedance(now)
        self._impedance.keep(memory[self.memory.impedance], state, view, motion, NO_SLACK)

    def rate(self, now: Now, rate: Array) -> None:
        """Writes the derivative of C's state."""
        self._impedance.rate(self._of_impedance(now), rate)

    def _sample(self, memory: Array, now: Now) -> None:
        motion = now.output("compliant_motion")
        self._kinematics.advance(memory[self.memory.kinematics], now, motion)

    def _of_kinematics(self, now: Now) -> Within:
        return Within(now, {}, {}, now.memory[self.memory.kinematics])

    def _of_impedance(self, now: Now) -> Within:
        given = {"measured_motion": self._kinematics.motion(now)}
        names = {"measured_motion": "estimated_state"}
        return Within(now, names, given, now.memory[self.memory.impedance], now.state)

    def _write_motion(self, now: Now, motion: Array) -> None:
        self._impedance.find(self._of_impedance(now), motion)

    def _written_by(self, output: Output) -> Callable[[Now, Array], None]:
        return lambda now, value: output.write(self._of_impedance(now), value)


def _of(output: Output, everything: Sequence[str]) -> Sequence[str]:
    """Returns what an output of the impedance depends on in the whole controller."""
    return output.of if tuple(output.of) == ("memory",) else everything
