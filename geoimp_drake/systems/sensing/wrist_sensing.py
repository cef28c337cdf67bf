"""What a wrist sensor does with a reaction force, for the systems that contain one or more."""

import logging
from collections.abc import Callable, Sequence

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialAcceleration, SpatialForce, SpatialVelocity
from pydrake.systems.framework import (
    CacheEntry,
    Context,
    InputPort,
    LeafSystem,
    ValueProducer,
)

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.dynamics.path_motion import pose_along
from geoimp_drake.laws.sensing.sensed_wrench import sensed_wrench
from geoimp_drake.laws.sensing.sensor_reading import filter_gain
from geoimp_drake.laws.sensing.sensor_sample import sensor_sample, sensor_sample_along
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.frame_motion import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    LINEAR_ACCELERATION,
    POSITION,
    check_frame_motion,
    check_signal,
)
from geoimp_drake.systems.sensing.counted_noise import CountedNoise
from geoimp_drake.systems.sensing.wrist_sensor_config import WristSensor
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, finite_vector

__all__ = [
    "PLANT_LISTS",
    "WristSensing",
    "declare_plant_ports",
    "initial_wrench",
    "read_plant",
]

_log = logging.getLogger("drake")

_AXES = ("moment x", "moment y", "moment z", "force x", "force y", "force z")


# What the plant says, as lists over its joints or bodies.
PLANT_LISTS = {
    "reaction_forces": SpatialForce,
    "body_poses": RigidTransform,
    "body_spatial_velocities": SpatialVelocity,
    "body_spatial_accelerations": SpatialAcceleration,
}


def declare_plant_ports(
    system: LeafSystem, sensors: Sequence[WristSensor], *, all_of_them: bool
) -> dict[str, InputPort]:
    """Declares a system's inputs for what the plant says; returns them by name.

    There is a port `state` for [q; v] if there is a path to a tool, and unless all are asked for,
    one for poses, velocities and accelerations only if a sensor needs it.

    Args:
        system: which gets them.
        sensors: of one plant.
        all_of_them: whether poses, velocities and accelerations are asked for in any case.
    """
    states = [sensor.mounting.num_states for sensor in sensors if sensor.mounting.path is not None]
    moves = any(_moves_as_the_plant(sensor) for sensor in sensors)
    is_needed = {"reaction_forces": True, "body_poses": len(states) < len(sensors)}
    ports = {
        name: system.DeclareAbstractInputPort(name, AbstractValue.Make([element()]))
        for name, element in PLANT_LISTS.items()
        if all_of_them or is_needed.get(name, moves)
    }
    if states:
        ports["state"] = system.DeclareVectorInputPort("state", states[0])
    return ports


def read_plant(
    ports: dict[str, InputPort], context: Context
) -> tuple[list[SpatialForce], Array | None]:
    """Returns the plant's reaction forces, and its [q; v] if there is a path to a tool.

    Args:
        ports: of a system, see `declare_plant_ports`.
        context: of the system.
    """
    state = ports.get("state")
    return ports["reaction_forces"].Eval(context), None if state is None else state.Eval(context)


def _moves_as_the_plant(sensor: WristSensor) -> bool:
    """Whether the inertial load of a sensor's tool is that of the plant's motion."""
    return sensor.config.inertial_load == "plant"


def initial_wrench(sensor: WristSensor) -> Array:
    """Returns h (6) until a sensor's first sample."""
    start = np.zeros(6) if sensor.initial_wrench is None else sensor.initial_wrench
    return finite_vector(start, "initial_wrench", 6)


class WristSensing:
    """One wrist sensor as a part of a system, which keeps the state and has the ports.

    Args:
        system: whose part it is.
        sensor: where the sensor sits, what it carries, how it reads.
        ports: of the system, see `declare_plant_ports`.
        suffix: of the system's ports that belong to this sensor.

    Attributes:
        follows: whether the tool's inertial load is that of a reference motion.

    Raises:
        ConfigurationError: a field cannot be used.
    """

    def __init__(
        self, system: Block, sensor: WristSensor, ports: dict[str, InputPort], suffix: str
    ):
        check(sensor.config, "sensor")
        check(sensor.tool, "tool")
        mounting, tool, config = sensor.mounting, sensor.tool, sensor.config
        self._mounting, self._ports = mounting, ports
        self._system, self._suffix, self._name = system, suffix, sensor.name
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
        self._generator = self._declare_generator(config.seed)

    def _declare_generator(self, seed: int) -> CacheEntry:
        """Declares the generator of the noise, of which each context has its own."""
        return self._system.DeclareCacheEntry(
            f"generator of the noise{self._suffix}",
            ValueProducer(
                lambda: AbstractValue.Make(CountedNoise(seed)),
                lambda context, value: None,
            ),
            {self._system.nothing_ticket()},
        )

    def sample(
        self,
        context: Context,
        count: int,
        forces: list[SpatialForce],
        plant_state: Array | None,
        motion: Array,
        before: Callable[[], Array],
        reading: Array,
        peak: Array,
        h: Array,
    ) -> None:
        """Takes a sample.

        Args:
            context: of the system.
            count: of samples before, at least one.
            forces: the plant's reaction forces.
            plant_state: [q; v] of the plant, if there is a path to the tool.
            motion: with which the tool's inertial load is removed, unless that is the plant's (19).
            before: tells `peak` as it was before; called if an axis leaves its range.
            reading: before this sample, moved on (6).
            peak: largest reading so far as a fraction of the range (6), moved on.
            h: where to write the wrench about Eo, in W (6).

        Raises:
            SignalError: a reaction force or the motion is NaN or infinite.
        """
        reaction = self._reaction(forces)
        raw = self._with_errors(context, reaction, count) if self._erroneous else reaction
        if self._of_plant:
            motion = self._plant_motion(context)
        gain = self._gain if count > 1 else 1.0  # the first sample passes through the filter
        rest = raw, motion, gain, *self._constants, reading, peak, h
        path = self._mounting.path
        if path is None or plant_state is None:
            sampled, saturates = self._sampling(self._tool_pose(context), *rest)
        else:
            sampled, saturates = self._sampling_along(path, plant_state, *rest)
        if saturates:
            self._warn(context, raw, before(), peak)
        if not sampled:
            self._check(motion, reaction, reading)

    def true_wrench(self, context: Context, motion: Array) -> Array:
        """Returns h without the sensor's errors.

        Args:
            context: of the system.
            motion: see `sample`.
        """
        h = np.empty(6)
        reaction, X_WT = (
            self._reaction(self._ports["reaction_forces"].Eval(context)),
            self._tool_pose(context),
        )
        if self._of_plant:
            motion = self._plant_motion(context)
        if not self._wrench(reaction, X_WT, *self._load, motion, h):
            self._check(motion, reaction)
        return h

    def _warn(self, context: Context, raw: Array, before: Array, peak: Array) -> None:
        """Says which axis leaves its range, the first time that it does."""
        name = self._name or self._system.get_name()
        for axis in np.flatnonzero((before <= 1.0) & (peak > 1.0)):
            _log.warning(
                f"{name} saturates at t = {context.get_time():.3f} s: {_AXES[axis]} is "
                f"{raw[axis]:.1f}, the range is ±{self._range[axis]:g}; the reading is clipped."
            )

    def _check(self, motion: Array, *readings: Array) -> None:
        name = self._system.get_name()
        for reading in readings:
            check_signal(reading, f"{name}:reaction_forces")
        check_frame_motion(motion, f"{name}:reference_motion{self._suffix}")

    def _reaction(self, forces: list[SpatialForce]) -> Array:
        """Returns the reaction [moment; force] on the tool about So, in S."""
        reaction: Array = forces[self._joint].get_coeffs()
        return reaction if self._mounting.sign > 0 else -reaction

    def _with_errors(self, context: Context, reaction: Array, count: int) -> Array:
        """Returns a reaction with bias and with the noise of a sample."""
        biased = reaction + self._bias
        if not self._noisy:
            return biased
        return biased + self._noise * self._generator.Eval(context).draw(count, 6)

    def _tool_pose(self, context: Context) -> Array:
        """Returns X_WT (3, 4)."""
        if self._mounting.path is not None:
            return self._pose(self._mounting.path, self._ports["state"].Eval(context))
        poses: list[RigidTransform] = self._ports["body_poses"].Eval(context)
        return poses[self._tool_body].GetAsMatrix34()

    def _plant_motion(self, context: Context) -> Array:
        """Returns the motion of the tool in the plant (19)."""
        motion, k = np.zeros(FRAME_MOTION_SIZE), self._tool_body
        V = self._ports["body_spatial_velocities"].Eval(context)[k]
        A = self._ports["body_spatial_accelerations"].Eval(context)[k]
        motion[0] = 1.0
        motion[POSITION] = self._tool_pose(context)[:, 3]
        motion[ANGULAR_VELOCITY] = V.rotational()
        motion[ANGULAR_ACCELERATION] = A.rotational()
        motion[LINEAR_ACCELERATION] = A.translational()
        return motion
