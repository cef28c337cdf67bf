"""What a wrist sensor does with a reaction force, for the systems that contain one or more."""

import logging
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialAcceleration, SpatialForce, SpatialVelocity
from pydrake.systems.framework import (
    BasicVector,
    CacheEntry,
    Context,
    DiscreteValues,
    InputPort,
    LeafSystem,
    State,
    ValueProducer,
)

from geoimp_drake.compiled import compiled
from geoimp_drake.laws.path_motion import pose_along
from geoimp_drake.laws.sensed_wrench import sensed_wrench
from geoimp_drake.laws.sensor_reading import filter_gain
from geoimp_drake.laws.sensor_sample import sensor_sample, sensor_sample_along
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.counted_noise import CountedNoise
from geoimp_drake.systems.frame_motion import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    LINEAR_ACCELERATION,
    POSITION,
    check_frame_motion,
    check_signal,
    frame_motion_vector,
)
from geoimp_drake.systems.wrist_sensor_config import WristSensor
from geoimp_drake.typing import Array
from geoimp_drake.validation import finite_vector

__all__ = ["PlantPorts", "WristSensing"]

_log = logging.getLogger("drake")

_AXES = ("moment x", "moment y", "moment z", "force x", "force y", "force z")


@dataclass(frozen=True)
class PlantPorts:
    """A sensor's input ports for what the plant says."""

    forces: InputPort
    poses: InputPort
    velocities: InputPort
    accelerations: InputPort
    state: InputPort | None  # [q; v], read in the place of the poses

    @staticmethod
    def of(system: LeafSystem, num_states: int | None) -> "PlantPorts":
        """Declares the ports; without a number of states there is none for the state."""

        def declare(name: str, element: type) -> InputPort:
            return system.DeclareAbstractInputPort(name, AbstractValue.Make([element()]))

        return PlantPorts(
            declare("reaction_forces", SpatialForce),
            declare("body_poses", RigidTransform),
            declare("body_spatial_velocities", SpatialVelocity),
            declare("body_spatial_accelerations", SpatialAcceleration),
            None if num_states is None else system.DeclareVectorInputPort("state", num_states),
        )


class WristSensing:
    """One wrist sensor as a part of a system; it declares its own ports and state there.

    Args:
        system: whose part it is.
        sensor: where the sensor sits, what it carries, how it reads.
        ports: of the system, for what the plant says.
        reference_is_held: see `ForceTorqueSensor`.
        suffix: of the system's ports that belong to this sensor.
    """

    def __init__(
        self,
        system: Block,
        sensor: WristSensor,
        ports: PlantPorts,
        *,
        reference_is_held: bool,
        suffix: str = "",
    ):
        sensor.config.validate()
        sensor.tool.validate()
        mounting, tool, config = sensor.mounting, sensor.tool, sensor.config
        self._mounting, self._ports = mounting, ports
        self._system, self._suffix, self._name = system, suffix, sensor.name
        self._range = np.repeat([config.moment_range, config.force_range], 3)
        resolution = np.repeat([config.moment_resolution, config.force_resolution], 3)
        self._noise = np.repeat([config.moment_noise, config.force_noise], 3)
        self._bias = np.asarray(config.bias, dtype=float)
        self._noisy = bool(self._noise.any())
        self._erroneous = self._noisy or bool(self._bias.any())
        self._of_plant = config.inertial_load == "plant"
        self._of_held = config.inertial_load == "reference" and reference_is_held
        self.keeps_reference = config.inertial_load == "reference" and not reference_is_held
        self._joint, self._tool_body = int(mounting.joint), int(mounting.tool_body)
        self._gain = filter_gain(config.filter_cutoff, config.period)
        self._load = (
            mounting.X_TS.GetAsMatrix34(),
            mounting.X_TE.translation(),
            float(tool.mass),
            np.asarray(tool.centre_of_mass, dtype=float),
            np.asarray(tool.inertia, dtype=float),
            np.asarray(mounting.gravity, dtype=float),
        )
        self._constants = (resolution, self._range, *self._load)
        self._sampling, self._wrench = compiled(sensor_sample), compiled(sensed_wrench)
        self._sampling_along, self._pose = compiled(sensor_sample_along), compiled(pose_along)
        self._reference = system.DeclareVectorInputPort(
            f"reference_motion{suffix}", frame_motion_vector()
        )
        self._generator = self._declare_generator(config.seed)
        start = np.zeros(6) if sensor.initial_wrench is None else sensor.initial_wrench
        self._held = system.declare_state(finite_vector(start, "initial_wrench", 6))
        self._peak = system.declare_state(6)
        # The motion with which the tool's inertial load is removed: rest, unless one is followed.
        self._followed = system.declare_state(frame_motion_vector())

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

    def declare_outputs(self, memory: int) -> None:
        """Declares the outputs.

        Args:
            memory: the group of the system's state whose first entry counts the samples.
        """

        def calc_true(context: Context, output: BasicVector) -> None:
            samples = context.get_discrete_state(memory).value()[0]
            self._write_true(context, samples > 1, output.get_mutable_value())

        self._system.declare_state_output(f"wrench{self._suffix}", self._held)
        self._system.DeclareVectorOutputPort(f"wrench_true{self._suffix}", 6, calc_true)
        self._system.declare_state_output(f"peak_reading{self._suffix}", self._peak)

    def keep_reference(self, context: Context, state: State) -> None:
        """Takes the reference as it is when a discrete plant begins its step."""
        followed = state.get_mutable_discrete_state(self._followed)
        followed.SetFromVector(self._reference.Eval(context))

    def sample(
        self,
        context: Context,
        state: DiscreteValues,
        count: int,
        forces: list[SpatialForce],
        plant_state: Array | None,
        reading: Array,
    ) -> None:
        """Takes a sample.

        Args:
            context: of the system.
            state: of the system, to be moved on.
            count: of samples before, at least one.
            forces: the plant's reaction forces.
            plant_state: [q; v] of the plant, if there is a path to the tool.
            reading: before this sample, moved on (6).

        Raises:
            SignalError: a reaction force or the reference is NaN or infinite.
        """
        reaction = self._reaction(forces)
        raw = self._with_errors(context, reaction, count) if self._erroneous else reaction
        motion = self._load_motion(context, state)
        gain = self._gain if count > 1 else 1.0  # the first sample passes through the filter
        peak, h = state.get_mutable_value(self._peak), state.get_mutable_value(self._held)
        rest = raw, motion, gain, *self._constants, reading, peak, h
        path = self._mounting.path
        if path is None or plant_state is None:
            sampled, saturates = self._sampling(self._tool_pose(context), *rest)
        else:
            sampled, saturates = self._sampling_along(path, plant_state, *rest)
        if saturates:
            self._warn(context, raw, peak)
        if not sampled:
            self._check(motion, reaction, reading)

    def _write_true(self, context: Context, is_sampled: bool, h: Array) -> None:
        state = context.get_discrete_state()
        if not is_sampled:
            h[:] = state.value(self._held)
            return
        reaction, X_WT = self._reaction(self._ports.forces.Eval(context)), self._tool_pose(context)
        motion = self._load_motion(context, state)
        if not self._wrench(reaction, X_WT, *self._load, motion, h):
            self._check(motion, reaction)

    def _warn(self, context: Context, raw: Array, peak: Array) -> None:
        """Says which axis leaves its range, the first time that it does."""
        before = context.get_discrete_state(self._peak).value()
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
        if self._mounting.path is not None and self._ports.state is not None:
            return self._pose(self._mounting.path, self._ports.state.Eval(context))
        poses: list[RigidTransform] = self._ports.poses.Eval(context)
        return poses[self._tool_body].GetAsMatrix34()

    def _load_motion(self, context: Context, state: DiscreteValues) -> Array:
        """Returns the motion with which the tool's inertial load is removed."""
        if self._of_held:
            held: Array = self._reference.Eval(context)
            return held
        if not self._of_plant:
            # A copy: a law is compiled once more for an array that cannot be written to.
            followed: Array = state.get_vector(self._followed).CopyToVector()
            return followed
        motion, k = np.zeros(FRAME_MOTION_SIZE), self._tool_body
        V = self._ports.velocities.Eval(context)[k]
        A = self._ports.accelerations.Eval(context)[k]
        motion[0] = 1.0
        motion[POSITION] = self._tool_pose(context)[:, 3]
        motion[ANGULAR_VELOCITY] = V.rotational()
        motion[ANGULAR_ACCELERATION] = A.rotational()
        motion[LINEAR_ACCELERATION] = A.translational()
        return motion
