"""An arm as its joints are read: the motion of E, and kinematics and dynamics at a reading."""

import numpy as np

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.arm.state import ArmState
from geoimp_drake.compilation.compiled import bound
from geoimp_drake.laws.compositions.arm_quantities import measured_motion
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import smallest_singular_value
from geoimp_drake.parts.joint_readings import Readings
from geoimp_drake.parts.law_signals import ArmSignals
from geoimp_drake.parts.part import Memory, Now, nested
from geoimp_drake.parts.signals import check_signal
from geoimp_drake.typing import Array

__all__ = ["ReadArm"]


class ReadArm:
    """What follows from a reading alone, for a part that keeps readings in its memory.

    Args:
        model: the arm.
        readings: how the joints are read.
        memory: of the part; its place `readings` is that of the readings.
        port: the input that is read.

    Attributes:
        model: the arm.
        readings: how the joints are read.
        count: place in the memory that is zero until there has been a reading.
        chain: the arm, memory for its quantities and the order of a reading, as laws take them.
    """

    def __init__(self, model: ControlModel, readings: Readings, memory: Memory, port: str):
        self.model, self.readings = model, readings
        self._readings, self._port = memory.readings, port
        self.count: int = memory.readings.start + readings.memory.count
        self._reading = nested(memory.readings, readings.memory.reading)
        self._dynamics = ChainDynamics(model)
        self.chain = *self._dynamics.arguments, model.state_order
        self._measured = bound(measured_motion, *self.chain)

    def has_reading(self, memory: Array) -> bool:
        """Whether there has been a reading."""
        return bool(memory[self.count])

    def pass_through(self, memory: Array, now: Now) -> Array:
        """Returns the memory with a reading: before the first one, that of the port.

        Args:
            memory: of this part, which may be written.
            now: the inputs.
        """
        self.readings.held(memory[self._readings], now, self._port)
        return memory

    def write_motion(self, memory: Array, now: Now, motion: Array) -> None:
        """Writes the motion of E in W from the reading, with zero accelerations.

        Args:
            memory: of this part, with a reading.
            now: has the ports' names.
            motion: where to write (19).

        Raises:
            SignalError: the reading is NaN or infinite.
        """
        reading = memory[self._readings]
        if not self._measured(reading, motion):
            self._check_reading(memory, now)

    def motion(self, memory: Array, now: Now) -> Array:
        """Returns what `write_motion` writes (19,); arguments and errors are the same."""
        motion = np.empty(FRAME_MOTION_SIZE)
        self.write_motion(memory, now, motion)
        return motion

    def measured(self, memory: Array, now: Now, signals: ArmSignals) -> Array:
        """Returns what `write_motion` writes, in a persistent array (19,).

        Args:
            memory: of this part, with a reading.
            now: has the ports' names.
            signals: of this arm.

        Raises:
            SignalError: the reading is NaN or infinite.
        """
        signals.take(memory, self._reading)
        if not signals.measure():
            self._check_reading(memory, now)
        return signals.motion

    def arm_state(self, memory: Array, now: Now) -> ArmState:
        """Returns kinematics and dynamics at the reading; arguments and errors as of `motion`."""
        self._check_reading(memory, now)
        return self._arm(memory[self._readings])

    def smallest_singular_value(self, memory: Array, now: Now) -> float:
        """Returns the smallest singular value of the Jacobian of E, in rad and m.

        Args:
            memory: of this part, with a reading.
            now: has the ports' names.

        Raises:
            SignalError: the reading is NaN or infinite.
        """
        return float(smallest_singular_value(self.arm_state(memory, now).Jv_V_WE))

    def _arm(self, readings: Array) -> ArmState:
        return self._dynamics.evaluate(None, readings[self.model.state_order])

    def _jacobian(self, readings: Array) -> Array:
        return self._arm(readings).Jv_V_WE

    def _check_reading(self, memory: Array, now: Now) -> None:
        reading = memory[self._readings][self.readings.memory.reading]
        check_signal(reading, now.port(self._port))
