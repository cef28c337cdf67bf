"""A wrist force/torque sensor: from a weld joint's reaction force to the wrench h of the laws."""

import logging
from dataclasses import dataclass, field

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialAcceleration, SpatialForce, SpatialVelocity
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import (
    BasicVector,
    CacheEntry,
    Context,
    DiscreteValues,
    InputPort,
    State,
    ValueProducer,
)

from geoimp_drake.compiled import compiled
from geoimp_drake.errors import ConfigurationError
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
from geoimp_drake.typing import Array
from geoimp_drake.validation import choice, finite_vector, non_negative, positive

__all__ = ["ForceTorqueSensor", "SensorMounting", "ToolLoad", "WristSensorConfig"]

_log = logging.getLogger("drake")

# In one group of the state: the last reading and how many samples there have been.
_READING, _COUNT = slice(0, 6), 6

_AXES = ("moment x", "moment y", "moment z", "force x", "force y", "force z")


@dataclass
class WristSensorConfig:
    """Sampling, errors and range of a wrist sensor; the default is ideal, read every 1 ms."""

    period: float = 1e-3  # [s]
    force_range: float = np.inf  # beyond it the reading is clipped, and reported [N]
    moment_range: float = np.inf  # [Nm]
    force_resolution: float = 0.0  # quantisation step, zero for none [N]
    moment_resolution: float = 0.0  # [Nm]
    force_noise: float = 0.0  # standard deviation of a sample [N]
    moment_noise: float = 0.0  # [Nm]
    bias: Array = field(default_factory=lambda: np.zeros(6))  # [moment; force] in S
    filter_cutoff: float = 0.0  # of the first-order low-pass, zero for none [Hz]
    inertial_load: str = "none"  # of the tool, removed by: none, plant, reference
    seed: int = 0  # of the noise

    def validate(self) -> None:
        """Raises ConfigurationError if a field cannot be used."""
        positive(self.period, "sensor.period", "s")
        for key in ("force_range", "moment_range"):
            if not getattr(self, key) > 0:
                raise ConfigurationError(
                    f"sensor.{key} is {getattr(self, key):g}; it must be positive (.inf for none)."
                )
        for key in (
            "force_resolution",
            "moment_resolution",
            "force_noise",
            "moment_noise",
            "filter_cutoff",
        ):
            non_negative(getattr(self, key), f"sensor.{key}")
        finite_vector(self.bias, "sensor.bias", 6)
        choice(self.inertial_load, "sensor.inertial_load", ("none", "plant", "reference"))
        if self.seed < 0:
            raise ConfigurationError(f"sensor.seed is {self.seed}; it must not be negative.")


@dataclass
class ToolLoad:
    """What hangs on a sensor besides the contact: removed from its reading."""

    mass: float = 0.0  # [kg]
    centre_of_mass: Array = field(default_factory=lambda: np.zeros(3))  # p_SC in S [m]
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))  # about C, in S [kg m²]

    def validate(self) -> None:
        """Raises ConfigurationError if a field cannot be used."""
        non_negative(self.mass, "tool.mass", "kg")
        finite_vector(self.centre_of_mass, "tool.centre_of_mass", 3)
        inertia = np.asarray(self.inertia, dtype=float)
        if inertia.shape != (3, 3) or not np.isfinite(inertia).all():
            raise ConfigurationError(f"tool.inertia is {inertia.tolist()}; give a 3×3 matrix.")


@dataclass(frozen=True)
class SensorMounting:
    """Where the sensor sits in its plant.

    Frames: S the weld joint's frame on its child body; T the tool, the body on the joint's far
    side; E the end effector.
    """

    joint: int  # its place among the plant's joints, in whose order the reaction forces are
    tool_body: BodyIndex
    X_TS: RigidTransform
    X_TE: RigidTransform
    gravity: Array  # in W (3) [m/s²]
    sign: float = 1.0  # −1 if the tool is the joint's parent: a reaction acts on the child
    path: Array | None = None  # to the tool, see `kinematic_tree.path_to`; None takes `body_poses`
    num_states: int = 0  # of the plant, if there is a path


class ForceTorqueSensor(Block):
    """Measures the wrench that the end effector exerts on its environment.

    The reaction force of a weld joint carries the tool's weight and inertia besides the contact
    wrench. With the load of the tool alone (laws/sensed_wrench.py) removed,

        f = f_S − m (a_C − g),   μ = μ_S − (p_SC × m (a_C − g) + I ω̇ + ω × I ω) − p_SE × f,

    is the wrench of (2.2): by the end effector on the environment, about E's origin, in W.
    The reading is made in the sensor's axes and in this order: bias, noise, quantisation,
    saturation, low-pass filter; then the tool's load is removed.

    It is sampled, which breaks the algebraic loop wrench → torque → wrench. A plant has no
    reaction forces before its first step, so the first sample counts one period after the
    start; until then the wrench is what the hand is known to carry, zero unless given.

    The reference motion is read when a discrete plant begins its step: a reaction belongs to the
    motion that this step followed.

    Args:
        mounting: where the sensor sits.
        tool: mass, centre of mass and inertia beyond the sensor, in S.
        config: sampling, errors and range of the sensor.
        initial_wrench: h until the first sample (6) [Nm, N].
        reference_is_held: the reference is given by a state that holds what the plant's last step
            followed, such as `last_compliant_motion`, and needs not be read before the step.

    Raises:
        ConfigurationError: a field of the configuration cannot be used.
        SignalError: a reaction force or the reference is NaN or infinite.

    Ports:
        input reaction_forces: the plant's reaction forces, list of SpatialForce
        input body_poses: the plant's body poses, list of RigidTransform
        input body_spatial_velocities: for `inertial_load: plant`, list of SpatialVelocity
        input body_spatial_accelerations: for the same, list of SpatialAcceleration
        input reference_motion: for `inertial_load: reference`, the motion that E follows (19)
        input state: [q; v] of the plant, read in the place of `body_poses`, which costs more (2n)
        output wrench: measured wrench [moment; force] (6) [Nm, N]
        output wrench_true: the same before bias, noise, quantisation, saturation and filter (6)
        output peak_reading: largest reading since the start as a fraction of the range (6)

        Without a path to the tool (other joints than revolute and prismatic ones lead to it) there
        is no port `state`.
    """

    def __init__(
        self,
        mounting: SensorMounting,
        tool: ToolLoad,
        config: WristSensorConfig,
        initial_wrench: Array | None = None,
        *,
        reference_is_held: bool = False,
    ):
        super().__init__()
        config.validate()
        tool.validate()
        self._mounting, self._config = mounting, config
        self._range = np.repeat([config.moment_range, config.force_range], 3)
        self._resolution = np.repeat([config.moment_resolution, config.force_resolution], 3)
        self._noise = np.repeat([config.moment_noise, config.force_noise], 3)
        self._bias = np.asarray(config.bias, dtype=float)
        self._noisy = bool(self._noise.any())
        self._erroneous = self._noisy or bool(self._bias.any())
        self._of_plant = config.inertial_load == "plant"
        self._of_reference = config.inertial_load == "reference"
        self._of_held = self._of_reference and reference_is_held
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
        self._constants = (self._resolution, self._range, *self._load)
        self._sampling, self._wrench = compiled(sensor_sample), compiled(sensed_wrench)
        self._sampling_along, self._pose = compiled(sensor_sample_along), compiled(pose_along)
        self._declare_inputs()
        self._generator = self._declare_generator(config.seed)
        start = np.zeros(6) if initial_wrench is None else initial_wrench
        self._held = self.declare_state(finite_vector(start, "initial_wrench", 6))
        self._peak = self.declare_state(6)
        self._memory = self.declare_state(7)
        # The motion with which the tool's inertial load is removed: rest, unless one is followed.
        self._followed = self.declare_state(frame_motion_vector())
        self.declare_state_output("wrench", self._held)
        self.DeclareVectorOutputPort("wrench_true", 6, self._calc_true)
        self.declare_state_output("peak_reading", self._peak)
        # Without offset, so that its instants are those of the plant's steps to the last bit.
        self.DeclarePeriodicDiscreteUpdateEvent(config.period, 0.0, self._sample)
        if self._of_reference and not reference_is_held:
            # Unrestricted updates come first, together with the step of a plant with sampled output
            # ports: what the step has evaluated is not evaluated again.
            self.DeclarePeriodicUnrestrictedUpdateEvent(config.period, 0.0, self._keep_reference)

    def _declare_inputs(self) -> None:
        def declare(name: str, element: type) -> InputPort:
            return self.DeclareAbstractInputPort(name, AbstractValue.Make([element()]))

        self._forces = declare("reaction_forces", SpatialForce)
        self._poses = declare("body_poses", RigidTransform)
        self._velocities = declare("body_spatial_velocities", SpatialVelocity)
        self._accelerations = declare("body_spatial_accelerations", SpatialAcceleration)
        self._reference = self.DeclareVectorInputPort("reference_motion", frame_motion_vector())
        if self._mounting.path is not None:
            self._state = self.DeclareVectorInputPort("state", self._mounting.num_states)

    def _declare_generator(self, seed: int) -> CacheEntry:
        """Declares the generator of the noise, of which each context has its own."""
        return self.DeclareCacheEntry(
            "generator of the noise",
            ValueProducer(
                lambda: AbstractValue.Make(CountedNoise(seed)),
                lambda context, value: None,
            ),
            {self.nothing_ticket()},
        )

    def _calc_true(self, context: Context, output: BasicVector) -> None:
        h = output.get_mutable_value()
        state = context.get_discrete_state()
        if state.value(self._memory)[_COUNT] <= 1:
            h[:] = state.value(self._held)
            return
        reaction, X_WT = self._reaction(context), self._tool_pose(context)
        motion = self._load_motion(context, state.value(self._followed))
        if not self._wrench(reaction, X_WT, *self._load, motion, h):
            self._check(motion, reaction)

    def _sample(self, context: Context, state: DiscreteValues) -> None:
        # Drake hands over a copy of the context's state.
        memory = state.get_mutable_value(self._memory)
        count = int(memory[_COUNT])
        memory[_COUNT] = count + 1.0
        if count == 0:
            return  # the plant has not stepped yet
        reaction = self._reaction(context)
        raw = self._with_errors(context, reaction, count) if self._erroneous else reaction
        motion = self._load_motion(context, state.get_mutable_value(self._followed))
        gain = self._gain if count > 1 else 1.0  # the first sample passes through the filter
        reading, peak = memory[_READING], state.get_mutable_value(self._peak)
        h = state.get_mutable_value(self._held)
        rest = raw, motion, gain, *self._constants, reading, peak, h
        path = self._mounting.path
        if path is None:
            sampled, saturates = self._sampling(self._tool_pose(context), *rest)
        else:
            sampled, saturates = self._sampling_along(path, self._state.Eval(context), *rest)
        if saturates:
            self._warn(context, raw, peak)
        if not sampled:
            self._check(motion, reaction, reading)

    def _warn(self, context: Context, raw: Array, peak: Array) -> None:
        """Says which axis leaves its range, the first time that it does."""
        before = context.get_discrete_state(self._peak).value()
        for axis in np.flatnonzero((before <= 1.0) & (peak > 1.0)):
            _log.warning(
                f"{self.get_name()} saturates at t = {context.get_time():.3f} s: {_AXES[axis]} is "
                f"{raw[axis]:.1f}, the range is ±{self._range[axis]:g}; the reading is clipped."
            )

    def _check(self, motion: Array, *readings: Array) -> None:
        for reading in readings:
            check_signal(reading, f"{self.get_name()}:reaction_forces")
        check_frame_motion(motion, f"{self.get_name()}:reference_motion")

    def _keep_reference(self, context: Context, state: State) -> None:
        followed = state.get_mutable_discrete_state(self._followed)
        followed.SetFromVector(self._reference.Eval(context))

    def _reaction(self, context: Context) -> Array:
        """Returns the reaction [moment; force] on the tool about So, in S."""
        reaction: Array = self._forces.Eval(context)[self._joint].get_coeffs()
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
            return self._pose(self._mounting.path, self._state.Eval(context))
        poses: list[RigidTransform] = self._poses.Eval(context)
        return poses[self._tool_body].GetAsMatrix34()

    def _load_motion(self, context: Context, followed: Array) -> Array:
        """Returns the motion with which the tool's inertial load is removed."""
        if self._of_held:
            held: Array = self._reference.Eval(context)
            return held
        if not self._of_plant:
            return followed
        motion, k = np.zeros(FRAME_MOTION_SIZE), self._tool_body
        V, A = self._velocities.Eval(context)[k], self._accelerations.Eval(context)[k]
        motion[0] = 1.0
        motion[POSITION] = self._tool_pose(context)[:, 3]
        motion[ANGULAR_VELOCITY] = V.rotational()
        motion[ANGULAR_ACCELERATION] = A.rotational()
        motion[LINEAR_ACCELERATION] = A.translational()
        return motion
