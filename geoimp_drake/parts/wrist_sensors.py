"""Wrist sensors of one plant: from its reaction forces to wrenches."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialAcceleration, SpatialForce, SpatialVelocity

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.frame_motion import (
    FRAME_MOTION_SIZE,
)
from geoimp_drake.parts.counted_noise import CountedNoise
from geoimp_drake.parts.part import Memory, Now, Output, held, nested
from geoimp_drake.parts.signals import AT_REST
from geoimp_drake.parts.wrist_sensor import Sensor, moves_as_the_plant
from geoimp_drake.parts.wrist_sensor_config import WristSensor
from geoimp_drake.typing import Array

__all__ = ["PLANT_LISTS", "WristSensors"]

# The plant's outputs that are lists over its joints or bodies.
PLANT_LISTS: dict[str, type] = {
    "reaction_forces": SpatialForce,
    "body_poses": RigidTransform,
    "body_spatial_velocities": SpatialVelocity,
    "body_spatial_accelerations": SpatialAcceleration,
}


class WristSensors:
    """The part of `ForceTorqueSensors`, and a piece of controllers that contain sensors.

    Args:
        sensors: of one plant, in order; their periods are the same.
        reference_is_held: see `ForceTorqueSensor`.
        suffixes: behind the names of each sensor's ports; by default _1, _2 and so on.
        all_of_them: the plant's poses, velocities and accelerations are inputs in any case, not
            only if a sensor needs them.

    Attributes:
        period: of all sensors [s].
        plant_inputs: the inputs that the plant gives.
        wrenches: where in the memory each sensor's wrench h is.

    Raises:
        ConfigurationError: a field cannot be used, the periods differ or there is no sensor.
    """

    def __init__(
        self,
        sensors: Sequence[WristSensor],
        *,
        reference_is_held: bool = False,
        suffixes: Sequence[str] | None = None,
        all_of_them: bool = True,
    ):
        self.period = _common_period(sensors)
        if suffixes is None:
            suffixes = [f"_{k}" for k in range(1, len(sensors) + 1)]
        self._sensors = [
            Sensor(sensor, suffix) for sensor, suffix in zip(sensors, suffixes, strict=True)
        ]
        self._is_held = reference_is_held
        self.plant_inputs = _plant_inputs(sensors, all_of_them)
        references = [f"reference_motion{suffix}" for suffix in suffixes]
        self.inputs = {**self.plant_inputs, **dict.fromkeys(references, FRAME_MOTION_SIZE)}
        # When it began [s], the number of sampling instants so far, and the memory of each sensor.
        self.memory = Memory(
            began=0.0,
            count=0.0,
            **{f"sensor{sensor.suffix}": sensor.memory for sensor in self._sensors},
        )
        self._places: list[slice] = [
            getattr(self.memory, f"sensor{sensor.suffix}") for sensor in self._sensors
        ]
        self.wrenches = [
            nested(place, sensor.memory.h)
            for place, sensor in zip(self._places, self._sensors, strict=True)
        ]
        self._rest = AT_REST.copy()
        self.samplings = ((self.period, self.sample),)
        self.outputs = [output for k in range(len(sensors)) for output in self._outputs_of(k)]
        if not reference_is_held and any(sensor.follows for sensor in self._sensors):
            # Without references to keep there is nothing to do as a step begins.
            self.begin = self._keep_references

    def new_workspace(self) -> list[CountedNoise]:
        """Returns a generator of noise for each sensor."""
        return [CountedNoise(sensor.seed) for sensor in self._sensors]

    def start(self, memory: Array, now: Now) -> None:
        """Remembers when it begins: the plant has not stepped yet."""
        memory[self.memory.began] = now.time

    def sample(self, memory: Array, now: Now) -> None:
        """Takes a sample of each sensor.

        Raises:
            SignalError: a reaction force or a reference is NaN or infinite.
        """
        if memory[self.memory.count] == 0:
            memory[self.memory.count] = 1.0
            return  # the plant has not stepped yet
        places = enumerate(self._places)
        self._take(memory, now, now.workspace, [self._motion(k, memory[p], now) for k, p in places])

    def take(self, memory: Array, now: Now, place: int, followed: Sequence[Array]) -> None:
        """Takes a sample of each sensor, as a part within another one.

        Args:
            memory: of this part, updated.
            now: of the outer part.
            place: of this part's workspace in the outer one's.
            followed: the motions (19) that the plant's last step followed, one per sensor.

        Raises:
            SignalError: a reaction force or a reference is NaN or infinite.
        """
        if memory[self.memory.count] == 0:
            memory[self.memory.count] = 1.0
            return
        motions = [
            motion if sensor.follows else self._rest
            for sensor, motion in zip(self._sensors, followed, strict=True)
        ]
        self._take(memory, now, now.workspace[place], motions)

    def _take(
        self, memory: Array, now: Now, generators: list[CountedNoise], motions: Sequence[Array]
    ) -> None:
        count = int(memory[self.memory.count])
        memory[self.memory.count] = count + 1.0
        forces = now["reaction_forces"]
        state = now["state"] if "state" in self.plant_inputs else None
        for k, sensor in enumerate(self._sensors):
            place = memory[self._places[k]]
            sensor.sample(place, now, count, generators[k], forces, state, motions[k])

    def _keep_references(self, memory: Array, state: Array, now: Now) -> None:
        for sensor, place in zip(self._sensors, self._places, strict=True):
            if sensor.follows:
                motion = now[f"reference_motion{sensor.suffix}"]
                memory[place][sensor.memory.followed] = motion

    def _motion(self, k: int, place: Array, now: Now) -> Array:
        """Returns the motion with which a tool's inertial load is removed (19)."""
        sensor = self._sensors[k]
        if not sensor.follows:
            return self._rest
        if self._is_held:
            motion: Array = now[f"reference_motion{sensor.suffix}"]
            return motion
        return place[sensor.memory.followed]

    def _outputs_of(self, k: int) -> list[Output]:
        sensor = self._sensors[k]
        plant = ["memory", "time", *self.plant_inputs]
        plant += [f"reference_motion{sensor.suffix}"] if self._is_held else []
        return [
            held(f"wrench{sensor.suffix}", self.wrenches[k]),
            Output(f"wrench_true{sensor.suffix}", 6, partial(self._write_true, k), plant),
            held(f"peak_reading{sensor.suffix}", nested(self._places[k], sensor.memory.peak)),
        ]

    def _write_true(self, k: int, now: Now, h: Array) -> None:
        memory = now.memory
        place = memory[self._places[k]]
        # From the plant's first step on, whether the sensor has been read or not.
        if now.time > memory[self.memory.began]:
            self._sensors[k].write_true_wrench(now, self._motion(k, place, now), h)
        else:
            h[:] = memory[self.wrenches[k]]


def _common_period(sensors: Sequence[WristSensor]) -> float:
    if not sensors:
        raise ConfigurationError("There is no sensor; give at least one.")
    periods = {sensor.config.period for sensor in sensors}
    if len(periods) > 1:
        raise ConfigurationError(
            f"The sensors' periods are {sorted(periods)} s; sensors in one system need the "
            f"same. Add them one by one for different ones."
        )
    return periods.pop()


def _plant_inputs(sensors: Sequence[WristSensor], all_of_them: bool) -> Mapping[str, Any]:
    """Returns the inputs that the plant feeds; `state` only if there is a path to a tool."""
    states = [sensor.mounting.num_states for sensor in sensors if sensor.mounting.path is not None]
    moves = any(map(moves_as_the_plant, sensors))
    is_needed = {"reaction_forces": True, "body_poses": len(states) < len(sensors)}
    lists = {
        name: [element()]
        for name, element in PLANT_LISTS.items()
        if all_of_them or is_needed.get(name, moves)
    }
    return lists | ({"state": states[0]} if states else {})
