"""One wrist sensor: from its joint's reaction force to a wrench."""

import logging

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.compositions.sensor_sample import sensor_sample, sensor_sample_along
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
from geoimp_drake.parts.counted_noise import CountedNoise, noise_key
from geoimp_drake.parts.part import Memory, Now
from geoimp_drake.parts.signals import AT_REST, check_frame_motion, check_signal
from geoimp_drake.parts.wrist_sensor_config import WristSensor
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, finite_vector

__all__ = ["Sensor", "moves_as_the_plant"]

_log = logging.getLogger("drake")

_AXES = ("moment x", "moment y", "moment z", "force x", "force y", "force z")


class Sensor:
    """One wrist sensor.

    Args:
        sensor: its mounting, its tool and its configuration.
        suffix: of its ports.

    Attributes:
        suffix: of its ports.
        seed: of its noise; sensors of other joints have other seeds.
        follows: whether the tool's inertial load is that of a reference motion.
        memory: the last reading, the largest so far as fractions of the range, and the wrench. Then
            the motion that the plant's last step followed, and delayed readings.
    """

    def __init__(self, sensor: WristSensor, suffix: str):
        check(sensor.config, "sensor")
        check(sensor.tool, "tool")
        mounting, tool, config = sensor.mounting, sensor.tool, sensor.config
        self.suffix = suffix
        self.seed = noise_key(config.seed, mounting.joint_name or f"joint {mounting.joint}")
        self._mounting, self._name = mounting, sensor.name
        self._range = np.repeat([config.moment_range, config.force_range], 3)
        resolution = np.repeat([config.moment_resolution, config.force_resolution], 3)
        self._noise = np.repeat([config.moment_noise, config.force_noise], 3)
        self._bias = np.asarray(config.bias, dtype=float)
        self._noisy = bool(self._noise.any())
        self._erroneous = self._noisy or bool(self._bias.any())
        self._is_late = config.late_samples > 0
        self._of_plant = moves_as_the_plant(sensor)
        self.follows = config.inertial_load == "reference"
        self._joint, self._tool_body = int(mounting.joint), int(mounting.tool_body)
        self._gain = filter_gain(config.filter_cutoff, config.period)
        self._load = (
            mounting.X_TS.GetAsMatrix34(),
            # A copy: part of a matrix is slower to pass to a compiled law.
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
            late=np.zeros(6 * config.late_samples),
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
            memory: of this sensor, updated.
            now: the inputs.
            count: of the sampling instants before this one, at least one: the first has no sample.
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
        if self._is_late:
            raw = _delayed(memory[self.memory.late].reshape(-1, 6), raw, count)
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
            self._check(now, motion, reaction, raw, reading)

    def write_true_wrench(self, now: Now, motion: Array, h: Array) -> None:
        """Writes h without the sensor's errors, filter and delay.

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
        """Returns the tool's motion in the plant (19), as far as its inertial load depends on it.

        The quaternion is that of no rotation, and the linear velocity is zero.
        """
        motion, k = np.zeros(FRAME_MOTION_SIZE), self._tool_body
        V = now["body_spatial_velocities"][k]
        A = now["body_spatial_accelerations"][k]
        motion[0] = 1.0
        motion[POSITION] = self._tool_pose(now)[:, 3]
        motion[ANGULAR_VELOCITY] = V.rotational()
        motion[ANGULAR_ACCELERATION] = A.rotational()
        motion[LINEAR_ACCELERATION] = A.translational()
        return motion


def _delayed(line: Array, raw: Array, count: int) -> Array:
    """Returns the reading that comes out of a line (k, 6), as a new one goes in.

    The first reading fills the line: an arm begins at rest.
    """
    if count == 1:
        line[:] = raw
    late = line[0].copy()
    line[:-1] = line[1:].copy()
    line[-1] = raw
    return late


def moves_as_the_plant(sensor: WristSensor) -> bool:
    """Whether the inertial load of a sensor's tool is that of the plant's motion."""
    return sensor.config.inertial_load == "plant"
