"""The wrist sensors of both hands as a part of the system that controls the arms."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from pydrake.systems.framework import Context

from geoimp_drake.systems.block import Block
from geoimp_drake.systems.declaring import declare_output, tickets_of
from geoimp_drake.systems.frame_motion import FRAME_MOTION_SIZE, frame_motion_vector
from geoimp_drake.systems.sensing.wrist_sensing import (
    WristSensing,
    declare_plant_ports,
    initial_wrench,
    read_plant,
)
from geoimp_drake.systems.sensing.wrist_sensor_config import WristSensor
from geoimp_drake.typing import Array

__all__ = ["HandSensors"]


class HandSensors:
    """What `ForceTorqueSensors` does, within a system that knows what the hands follow.

    The system keeps, in a place of its memory, how many samples there have been; the motions that
    the plant's last step followed, with which the tools' inertial loads are removed; and of each
    hand reading, largest reading and wrench.

    Args:
        system: whose part they are; gets the ports for what the plant says.
        sensors: of both hands, in order; they are read when the system says.
        start: of the place in the memory.

    Attributes:
        memory_at_start: what the place holds.

    Raises:
        ConfigurationError: a field cannot be used.
    """

    def __init__(self, system: Block, sensors: Sequence[WristSensor], start: int):
        self._system = system
        self._ports = declare_plant_ports(system, sensors, all_of_them=False)
        self._sensings = [
            WristSensing(system, sensor, self._ports, f"_{k}")
            for k, sensor in enumerate(sensors, 1)
        ]
        # How many samples, the references, and 18 of each hand.
        self._count, first, second = start, start + 1, start + 1 + FRAME_MOTION_SIZE
        hands = second + FRAME_MOTION_SIZE
        self._references = slice(first, second), slice(second, hands)
        self._places = [_Place.at(hands), _Place.at(hands + 18)]
        start_of = [np.concatenate((np.zeros(12), initial_wrench(sensor))) for sensor in sensors]
        self._at_rest = at_rest = frame_motion_vector().value().copy()
        self.memory_at_start = np.concatenate(([0.0], at_rest, at_rest, *start_of))
        self._measured = slice(hands, start + len(self.memory_at_start))

    def declare_outputs(self, group: int) -> None:
        """Declares the outputs.

        Args:
            group: of the system's state that is its memory.
        """
        memory = {self._system.ticket_of_state(group)}
        plant = memory | tickets_of(self._system, *self._ports.values())
        for k, place in enumerate(self._places):
            for name, law, tickets in (
                ("wrench", partial(self._part, group, place.h), memory),
                ("wrench_true", partial(self._true_wrench, group, k), plant),
                ("peak_reading", partial(self._part, group, place.peak), memory),
            ):
                declare_output(self._system, f"{name}_{k + 1}", 6, law, tickets)

    def wrenches(self, memory: Array) -> tuple[Array, Array]:
        """Returns the wrenches of both hands (6 each), as parts of the system's memory."""
        first, second = self._places
        return memory[first.h], memory[second.h]

    def keep_measured(self, before: Array, memory: Array) -> None:
        """Keeps samples when the system starts anew: the sensors have not.

        Args:
            before: the system's memory.
            memory: that which it is to start with.
        """
        memory[self._count] = before[self._count]
        memory[self._measured] = before[self._measured]

    def keep_references(self, references: Array, memory: Array) -> None:
        """Keeps the motions that the step which begins follows.

        Args:
            references: of both hands (2, 19).
            memory: of the system.
        """
        for place, reference in zip(self._references, references, strict=True):
            memory[place] = reference

    def sample(self, context: Context, group: int, memory: Array) -> None:
        """Takes a sample of each sensor.

        Args:
            context: of the system.
            group: of the system's state that is its memory.
            memory: of the system, to be moved on.

        Raises:
            SignalError: a reaction force or a reference is NaN or infinite.
        """
        count = int(memory[self._count])
        memory[self._count] = count + 1.0
        if count == 0:
            return  # the plant has not stepped yet
        forces, plant_state = read_plant(self._ports, context)
        for k, sensing in enumerate(self._sensings):
            place = self._places[k]
            sensing.sample(
                context,
                count,
                forces,
                plant_state,
                self._motion(k, memory),
                partial(self._part, group, place.peak, context),
                memory[place.reading],
                memory[place.peak],
                memory[place.h],
            )

    def _motion(self, k: int, memory: Array) -> Array:
        """Returns the motion with which a tool's inertial load is removed (19)."""
        return memory[self._references[k]] if self._sensings[k].follows else self._at_rest

    def _part(self, group: int, part: slice, context: Context) -> Array:
        held: Array = context.get_discrete_state(group).value()[part]
        return held

    def _true_wrench(self, group: int, k: int, context: Context) -> Array:
        memory = context.get_discrete_state(group).CopyToVector()
        if memory[self._count] > 1:
            return self._sensings[k].true_wrench(context, self._motion(k, memory))
        held: Array = memory[self._places[k].h]
        return held


@dataclass(frozen=True, slots=True)
class _Place:
    """Where the memory has what belongs to one hand."""

    reading: slice
    peak: slice
    h: slice

    @staticmethod
    def at(start: int) -> "_Place":
        return _Place(*(slice(start + k, start + k + 6) for k in (0, 6, 12)))
