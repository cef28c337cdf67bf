"""The whole impedance controller of one arm as one part."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE
from geoimp_drake.parts.direct_impedance import DirectImpedance
from geoimp_drake.parts.found_impedance import FoundImpedance
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.impedance_energy import ImpedanceEnergy
from geoimp_drake.parts.impedance_tick import ImpedanceTick
from geoimp_drake.parts.inner_loop import InnerLoop
from geoimp_drake.parts.joint_limits import slack_of
from geoimp_drake.parts.law_signals import ReadingSignals
from geoimp_drake.parts.natural_impedance import NaturalImpedance
from geoimp_drake.parts.part import Flows, Memory, Now, Output, held, nested
from geoimp_drake.parts.passivity import Passivity
from geoimp_drake.parts.within import Within
from geoimp_drake.parts.wrist_sensors import WristSensors
from geoimp_drake.typing import Array

__all__ = ["EndEffectorImpedance", "ImpedanceController"]

EndEffectorImpedance = Impedance | DirectImpedance | NaturalImpedance

_NO_WRENCH, _UNKNOWN, _NEVER = np.zeros(6), np.full(6, np.nan), float("nan")


class ImpedanceController:
    """Makes the end effector of an arm compliant: `ImpedanceIntegrator` and the inner loop.

    With a direct or a natural impedance it has no continuous state: C is then E as measured.

    Ports, laws and numbers are those of the blocks of `make_impedance_controller`, with fewer calls
    from C++ into Python.

    Args:
        impedance: of the end effector.
        loop: the arm's inner loop.
        sensor: the wrist sensor; None if the wrench is an input.
        passivity: what changes of the gains pass through; by default they pass unchanged.

    Raises:
        SignalError: an input is NaN or infinite, a quaternion is not unit, or C has diverged.
        SingularityError: six joints exactly singular without `limits`, or the attitude leaves the
            domain of an orientation law.
    """

    def __init__(
        self,
        impedance: EndEffectorImpedance,
        loop: InnerLoop,
        sensor: WristSensors | None = None,
        passivity: Passivity | None = None,
    ):
        self._impedance, self._loop, self._sensor = impedance, loop, sensor
        self._passivity = passivity = passivity or Passivity()
        self._changes_gains = passivity.changes_gains
        n = loop.model.num_joints
        self.models = [loop.model]
        self.inputs: dict[str, Any] = {
            "estimated_state": 2 * n,
            "desired_motion": FRAME_MOTION_SIZE,
            **({"wrench": 6} if sensor is None else {}),
            **passivity.inputs,
        }
        reading, found, torque = ("memory", "estimated_state"), "found", ("found", "time")
        self.found_of = "state", "memory", *self.inputs
        self.inputs |= {} if sensor is None else sensor.plant_inputs
        self._flows = False
        if isinstance(impedance, Flows):
            self.state, self.rate = impedance.state, self._rate
            self._hold_back, self._flows = impedance.hold_back, True
        self.memory = Memory(
            arm=loop.memory,
            impedance=impedance.memory,
            sensor=Memory() if sensor is None else sensor.memory,
            passivity=passivity.memory,
        )
        self._feels = sensor is None and impedance.needs_wrench
        # Looked up in every tick.
        self._arm: slice = self.memory.arm
        self._own: slice = self.memory.impedance
        self._holds = self._own.start + impedance.holds
        self._sensed = slice(0)
        if sensor is not None:
            self._sensed = nested(self.memory.sensor, sensor.wrenches[0])
        self._count = self.memory.arm.start + loop.count
        self._acts = nested(self.memory.arm, loop.acts)
        self._last = nested(self.memory.impedance, impedance.memory.last)
        self.samplings = [(loop.readings.period, self._read)]
        if sensor is not None:
            self.samplings.append((sensor.period, self._sense))
        loop_reports = loop.outputs(self.memory.arm)
        self.outputs = [
            Output("actuation", n, self._write_torque, (*torque, "memory")),
            Output("compliant_motion", FRAME_MOTION_SIZE, _write_motion, (found,)),
            Output("measured_motion", FRAME_MOTION_SIZE, self._write_measured, reading),
            Output("displacement", 6, self._write_displacement, (found, "desired_motion")),
            Output(
                "energy",
                len(ImpedanceEnergy.get_fields()),
                self._write_energy,
                (found, "desired_motion", *passivity.inputs),
            ),
            *loop_reports[:1],
            held("last_compliant_motion", self._last),
            # With six joints it is needed near a singularity, where there may be no torque.
            Output("smallest_singular_value", 1, self._write_singular_value, reading),
            Output("null_space_error", n, self._write_error, torque),
            Output("task_value", 1, self._write_task_value, torque),
        ]
        self.outputs += passivity.outputs(self.memory.passivity)
        self.outputs += loop_reports[1:]
        if sensor is not None:
            self.outputs += [
                output.within(self._of_sensor, self.inputs) for output in sensor.outputs
            ]

    def new_workspace(self) -> tuple[Any, Any, Any]:
        """Returns the workspaces of the loop and of the sensor, and arrays for the rate."""
        sensor = None if self._sensor is None else self._sensor.new_workspace()
        return self._loop.new_workspace(), sensor, self.new_found()

    def start(self, memory: Array, now: Now) -> None:
        """Takes the first reading and the requested gains."""
        self._loop.start(memory[self.memory.arm], now)
        self._passivity.start(memory[self.memory.passivity], now)
        if self._sensor is not None:
            self._sensor.start(memory[self.memory.sensor], now)

    def check_start(self, now: Now) -> None:
        """Evaluates the impedance, so that initialization already refuses unusable signals."""
        _ = now.found

    def new_found(self) -> FoundImpedance:
        """Returns the arrays that the motion of C and the torques are written to."""
        impedance = self._impedance.new_signals()
        return FoundImpedance(impedance, self._loop.new_signals(impedance.motion))

    def stay(
        self, memory: Array, inputs: Mapping[str, Array], state: Array, rate: Array
    ) -> tuple[Any, FoundImpedance, ImpedanceTick | None]:
        """Does what `new_workspace` and `new_found` do, for persistent memory and inputs."""
        arm, wrench = memory[self._arm], inputs.get("wrench", _NO_WRENCH)
        felt = wrench.copy() if self._impedance.needs_wrench is False else wrench
        given = inputs["desired_motion"], wrench
        found = []
        # The rate of the state, then what the outputs follow from.
        for own in ((state, rate), (state,)) if self._flows else ((), ()):
            impedance = self._impedance.new_signals(*given, *own)
            found.append(
                FoundImpedance(impedance, self._loop.new_signals(impedance.motion, arm, felt))
            )
        workspace = self._loop.stay(arm, inputs)
        tick = self._tick(memory, workspace.reading, found[1])
        return (workspace, None, found[0]), found[1], tick

    def _tick(
        self, memory: Array, reading: ReadingSignals, found: FoundImpedance
    ) -> ImpedanceTick | None:
        """Returns what does a tick in one call; None if a tick has more to do or to show."""
        impedance, loop = self._impedance, self._loop
        if not isinstance(impedance, Impedance) or self._changes_gains:
            return None
        if not (impedance.is_plain and loop.is_plain):
            return None
        last, holds = memory[self._last], memory[self._holds : self._holds + 1]
        return ImpedanceTick(impedance, loop, reading, found, last, holds, memory[self._acts])

    def find(self, now: Now, found: FoundImpedance) -> None:
        """Writes the motion of C."""
        memory = self._remembered(now)
        if memory is not found.memory:
            found.memory, found.own, found.arm_memory = memory, *self._places(memory)
        found.time = _NEVER
        found.wrench = wrench = now["wrench"] if self._feels else self._wrench(now, memory)
        view = self._view(now, memory) if self._changes_gains else now
        found.terms = self._impedance.follow(
            view, wrench, self._loop, found.arm_memory, found.impedance, found.arm
        )

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Starts C, or normalizes its quaternion; keeps what the limits do and compares torques.

        It also changes the gains for the step that begins.
        """
        found = self._resolved(now)
        _, _, bound, limited = found.reports
        own, arm = (found.own, found.arm_memory) if memory is found.memory else self._places(memory)
        view = self._view(now, found.memory) if self._changes_gains else now
        self._impedance.keep(own, state, view, found.motion, slack_of(limited))
        if self._changes_gains:
            place = memory[self.memory.passivity]
            self._passivity.keep(place, now, found.motion, lambda: self._measured(now, found))
        self._loop.compare_with_limits(arm, found.arm, bound, limited, now)

    def _places(self, memory: Array) -> tuple[Array, Array]:
        """Returns the memories of the impedance and of the arm."""
        return memory[self._own], memory[self._arm]

    def _measured(self, now: Now, found: FoundImpedance) -> tuple[Array, Array]:
        """Returns the last measured wrench and motion of E."""
        return found.wrench, self._loop.motion(found.arm_memory, now)

    def _view(self, now: Now, memory: Array) -> Now:
        """Returns what the impedance sees: the inputs with the granted gains."""
        return self._passivity.view(memory[self.memory.passivity], now)

    def _wrench(self, now: Now, memory: Array) -> Array:
        """Returns the measured wrench; NaN where there is none and none is needed."""
        if self._sensor is not None:
            return memory[self._sensed]
        if self._impedance.needs_wrench or now.has("wrench"):
            wrench: Array = now["wrench"]
            return wrench
        return _UNKNOWN

    def _rate(self, now: Now, rate: Array) -> None:
        """Writes the derivative of C's state; a part without impedance follows D."""
        found: FoundImpedance = now.workspace[2]
        self.find(now, found)
        if rate is not found.impedance.rate:
            rate[:] = found.impedance.rate
        if found.memory[self._holds]:
            self._hold_back(found.own, rate)

    def _read(self, memory: Array, now: Now) -> None:
        self._loop.sample(memory[self._arm], now)

    def _sense(self, memory: Array, now: Now) -> None:
        if self._sensor is not None:
            place = memory[self.memory.sensor]
            self._sensor.take(place, now, 1, [memory[self._last]])

    def _remembered(self, now: Now) -> Array:
        memory = now.memory
        if not memory[self._count]:
            self._loop.pass_through(memory[self._arm], now)
        return memory

    def _of_sensor(self, now: Now) -> Within:
        """Returns the sensor's inputs; the plant's last step followed the last motion of C."""
        memory = now.memory
        given = {"reference_motion": memory[self._last]}
        return Within(now, {}, given, memory[self.memory.sensor], place=1)

    def _write_torque(self, now: Now, u: Array) -> None:
        found = self._resolved(now)
        u[:] = self._loop.actuation(found.arm_memory, found.arm)

    def _write_measured(self, now: Now, motion: Array) -> None:
        self._loop.write_motion(self._remembered(now)[self.memory.arm], now, motion)

    def _write_displacement(self, now: Now, value: Array) -> None:
        value[:] = self._impedance.displacement(now["desired_motion"], now.found.motion)

    def _write_energy(self, now: Now, value: Array) -> None:
        found: FoundImpedance = now.found
        view = self._view(now, found.memory)
        value[:] = self._impedance.energy(view, found.motion, found.wrench, *found.terms)

    def _write_singular_value(self, now: Now, value: Array) -> None:
        memory = self._remembered(now)[self.memory.arm]
        value[:] = self._loop.smallest_singular_value(memory, now)

    def _write_error(self, now: Now, error: Array) -> None:
        # With six joints it is zero, even at a singularity.
        error[:] = self._resolved(now).reports[0] if self._loop.is_redundant else 0.0

    def _write_task_value(self, now: Now, value: Array) -> None:
        value[:] = self._resolved(now).reports[1] if self._loop.is_redundant else 0.0

    def _resolved(self, now: Now) -> FoundImpedance:
        """Returns the results, with torques of this time."""
        found: FoundImpedance = now.found
        if found.time != now.time:
            # What the impedance leaves out is not compensated in (2.3) either.
            h = found.wrench if self._impedance.needs_wrench else _NO_WRENCH
            if h is not found.arm.wrench:
                found.arm.wrench[:] = h
            found.reports = self._loop.write_torque(now, found.arm_memory, found.arm)
            found.time = now.time
        return found


def _write_motion(now: Now, motion: Array) -> None:
    motion[:] = now.found.motion
