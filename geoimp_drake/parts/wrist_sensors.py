"""Wrist sensors of one plant: from its reaction forces to wrenches."""

import logging
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialAcceleration, SpatialForce, SpatialVelocity

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.dynamics.path_motion import pose_along
from geoimp_drake.laws.frame_motion import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    LINEAR_ACCELERATION,
    POSITION,
)
from geoimp_drake.laws.sensing.sensed_wrench import sensed_wrench
from geoimp_drake.laws.sensing.sensor_reading import filter_gain
from geoimp_drake.laws.sensing.sensor_sample import sensor_sample, sensor_sample_along
from geoimp_drake.parts.counted_noise import CountedNoise
from geoimp_drake.parts.part import Memory, Now, Output, held, nested
from geoimp_drake.parts.signals import AT_REST, check_frame_motion, check_signal
from geoimp_drake.parts.wrist_sensor_config import WristSensor
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, finite_vector

__all__ = ["PLANT_LISTS", "WristSensors"]

_log = logging.getLogger("drake")

_AXES = ("moment x", "moment y", "moment z", "force x", "force y", "force z")

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
        plant_inputs: those of the inputs that the plant gives.
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
            _Sensor(sensor, suffix) for sensor, suffix in zip(sensors, suffixes, strict=True)
        ]
        self._is_held = reference_is_held
        self.plant_inputs = _plant_inputs(sensors, all_of_them)
        references = [f"reference_motion{suffix}" for suffix in suffixes]
        self.inputs = {**self.plant_inputs, **dict.fromkeys(references, FRAME_MOTION_SIZE)}
        # How many samples there have been, and what belongs to each sensor.
        self.memory = Memory(
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
        """Takes a sample of each sensor of a part within another one.

        Args:
            memory: of this part, moved on.
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
        plant = ["memory", *self.plant_inputs]
        plant += [f"reference_motion{sensor.suffix}"] if self._is_held else []
        return [
            held(f"wrench{sensor.suffix}", self.wrenches[k]),
            Output(f"wrench_true{sensor.suffix}", 6, partial(self._write_true, k), plant),
            held(f"peak_reading{sensor.suffix}", nested(self._places[k], sensor.memory.peak)),
        ]

    def _write_true(self, k: int, now: Now, h: Array) -> None:
        memory = now.memory
        place = memory[self._places[k]]
        if memory[self.memory.count] > 1:
            self._sensors[k].write_true_wrench(now, self._motion(k, place, now), h)
        else:
            h[:] = memory[self.wrenches[k]]


class _Sensor:
    """One wrist sensor.

    Args:
        sensor: its mounting, its tool and its configuration.
        suffix: of its ports.

    Attributes:
        follows: whether the tool's inertial load is that of a reference motion.
        memory: the last reading, the largest so far as fractions of the range, the wrench, and the
            motion that the plant's last step followed.
    """

    def __init__(self, sensor: WristSensor, suffix: str):
        check(sensor.config, "sensor")
        check(sensor.tool, "tool")
        mounting, tool, config = sensor.mounting, sensor.tool, sensor.config
        self.suffix, self.seed = suffix, config.seed
        self._mounting, self._name = mounting, sensor.name
        self._range = np.repeat([config.moment_range, config.force_range], 3)
        resolution = np.repeat([config.moment_resolution, config.force_resolution], 3)
        self._noise = np.repeat([config.moment_noise, config.force_noise], 3)
        self._bias = np.asarray(config.bias, dtype=float)
        self._noisy = bool(self._noise.any())
        self._erroneous = self._noisy or bool(self._bias.any())
        self._of_plant = _moves_as_the_plant(sensor)
        self.follows = config.inertial_load == "reference"
        self._joint, self._tool_body = int(mounting.joint), int(mounting.tool_body)
        self._gain = filter_gain(config.filter_cutoff, config.period)
        self._load = (
            mounting.X_TS.GetAsMatrix34(),
            # A copy: part of a matrix is slower to hand to a compiled law.
            np.array(mounting.X_TE.translation()),
            float(tool.mass),
            np.asarray(tool.centre_of_mass, dtype=float),
            np.asarray(tool.inertia, dtype=float),
            np.asarray(mounting.gravity, dtype=float),
        )
        self._constants = (resolution, self._range, *self._load)
        self._sampling, self._wrench = compiled(sensor_sample), compiled(sensed_wrench)
        self._sampling_along, self._pose = compiled(sensor_sample_along), compiled(pose_along)
        start = np.zeros(6) if sensor.initial_wrench is None else sensor.initial_wrench
        self.memory = Memory(
            reading=np.zeros(6),
            peak=np.zeros(6),
            h=finite_vector(start, "initial_wrench", 6),
            followed=AT_REST,
        )

    def sample(
        self,
        memory: Array,
        now: Now,
        count: int,
        generator: CountedNoise,
        forces: list[SpatialForce],
        plant_state: Array | None,
        motion: Array,
    ) -> None:
        """Takes a sample.

        Args:
            memory: of this sensor, moved on.
            now: the inputs.
            count: of samples before, at least one.
            generator: of the noise.
            forces: the plant's reaction forces.
            plant_state: [q; v] of the plant, if there is a path to a tool.
            motion: with which the tool's inertial load is removed, unless that is the plant's (19).

        Raises:
            SignalError: a reaction force or the motion is NaN or infinite.
        """
        reading, peak = memory[self.memory.reading], memory[self.memory.peak]
        reaction = self._reaction(forces)
        raw = self._with_errors(reaction, generator, count) if self._erroneous else reaction
        if self._of_plant:
            motion = self._plant_motion(now)
        before = peak.copy()
        gain = self._gain if count > 1 else 1.0  # the first sample passes through the filter
        rest = raw, motion, gain, *self._constants, reading, peak, memory[self.memory.h]
        path = self._mounting.path
        if path is None or plant_state is None:
            sampled, saturates = self._sampling(self._tool_pose(now), *rest)
        else:
            sampled, saturates = self._sampling_along(path, plant_state, *rest)
        if saturates:
            self._warn(now, raw, before, peak)
        if not sampled:
            self._check(now, motion, reaction, reading)

    def write_true_wrench(self, now: Now, motion: Array, h: Array) -> None:
        """Writes h without the sensor's errors.

        Args:
            now: the inputs.
            motion: see `sample`.
            h: where to write (6,).
        """
        reaction, X_WT = self._reaction(now["reaction_forces"]), self._tool_pose(now)
        if self._of_plant:
            motion = self._plant_motion(now)
        if not self._wrench(reaction, X_WT, *self._load, motion, h):
            self._check(now, motion, reaction)

    def _warn(self, now: Now, raw: Array, before: Array, peak: Array) -> None:
        """Warns which axis leaves its range, the first time that it does."""
        for axis in np.flatnonzero((before <= 1.0) & (peak > 1.0)):
            _log.warning(
                f"{self._name or now.system} saturates at t = {now.time:.3f} s: {_AXES[axis]} is "
                f"{raw[axis]:.1f}, the range is ±{self._range[axis]:g}; the reading is clipped."
            )

    def _check(self, now: Now, motion: Array, *readings: Array) -> None:
        for reading in readings:
            check_signal(reading, now.port("reaction_forces"))
        check_frame_motion(motion, now.port(f"reference_motion{self.suffix}"))

    def _reaction(self, forces: list[SpatialForce]) -> Array:
        """Returns the reaction [moment; force] on the tool about So, in S."""
        reaction: Array = forces[self._joint].get_coeffs()
        return reaction if self._mounting.sign > 0 else -reaction

    def _with_errors(self, reaction: Array, generator: CountedNoise, count: int) -> Array:
        """Returns a reaction with bias and with the noise of a sample."""
        biased = reaction + self._bias
        return biased + self._noise * generator.draw(count, 6) if self._noisy else biased

    def _tool_pose(self, now: Now) -> Array:
        """Returns X_WT (3, 4)."""
        if self._mounting.path is not None:
            return self._pose(self._mounting.path, now["state"])
        poses: list[RigidTransform] = now["body_poses"]
        return poses[self._tool_body].GetAsMatrix34()

    def _plant_motion(self, now: Now) -> Array:
        """Returns the motion of the tool in the plant (19)."""
        motion, k = np.zeros(FRAME_MOTION_SIZE), self._tool_body
        V = now["body_spatial_velocities"][k]
        A = now["body_spatial_accelerations"][k]
        motion[0] = 1.0
        motion[POSITION] = self._tool_pose(now)[:, 3]
        motion[ANGULAR_VELOCITY] = V.rotational()
        motion[ANGULAR_ACCELERATION] = A.rotational()
        motion[LINEAR_ACCELERATION] = A.translational()
        return motion


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
    moves = any(map(_moves_as_the_plant, sensors))
    is_needed = {"reaction_forces": True, "body_poses": len(states) < len(sensors)}
    lists = {
        name: [element()]
        for name, element in PLANT_LISTS.items()
        if all_of_them or is_needed.get(name, moves)
    }
    return lists | ({"state": states[0]} if states else {})


def _moves_as_the_plant(sensor: WristSensor) -> bool:
    """Whether the inertial load of a sensor's tool is that of the plant's motion."""
    return sensor.config.inertial_load == "plant"
