"""A wrist force/torque sensor: from a weld joint's reaction force to the wrench h of the laws."""

import logging
from dataclasses import dataclass, field

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialAcceleration, SpatialForce, SpatialVelocity
from pydrake.multibody.tree import BodyIndex, JointIndex
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws import sensed_wrench
from geoimp_drake.systems.frame_motion import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
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

    joint: JointIndex
    tool_body: BodyIndex
    X_TS: RigidTransform
    X_TE: RigidTransform
    gravity: Array  # in W (3) [m/s²]
    sign: float = 1.0  # −1 if the tool is the joint's parent: a reaction acts on the child


class ForceTorqueSensor(LeafSystem):
    """Measures the wrench that the end effector exerts on its environment.

    The reaction force of a weld joint carries the tool's weight and inertia besides the contact
    wrench. With the load of the tool alone (laws/sensed_wrench.py) removed,

        f = f_S − m (a_C − g),   μ = μ_S − (p_SC × m (a_C − g) + I ω̇ + ω × I ω) − p_SE × f,

    is the wrench of (2.2): by the end effector on the environment, about E's origin, in W.
    The reading is made in the sensor's axes and in this order: bias, noise, quantisation,
    saturation, low-pass filter; then the tool's load is removed.

    It is sampled, which breaks the algebraic loop wrench → torque → wrench. A plant has no
    reaction forces before its first step, so the first sample counts one period after the
    start; until then the wrench is zero.

    Args:
        mounting: where the sensor sits.
        tool: mass, centre of mass and inertia beyond the sensor, in S.
        config: sampling, errors and range of the sensor.

    Raises:
        ConfigurationError: a field of the configuration cannot be used.
        SignalError: a reaction force or the reference is NaN or infinite.

    Ports:
        input reaction_forces: the plant's reaction forces, list of SpatialForce
        input body_poses: the plant's body poses, list of RigidTransform
        input body_spatial_velocities: for `inertial_load: plant`, list of SpatialVelocity
        input body_spatial_accelerations: for the same, list of SpatialAcceleration
        input reference_motion: for `inertial_load: reference`, the motion that E follows (19)
        output wrench: measured wrench [moment; force] (6) [Nm, N]
        output wrench_true: the same before bias, noise, quantisation, saturation and filter (6)
        output peak_reading: largest reading since the start as a fraction of the range (6)
    """

    def __init__(self, mounting: SensorMounting, tool: ToolLoad, config: WristSensorConfig):
        super().__init__()
        config.validate()
        tool.validate()
        self._mounting = mounting
        self._tool = tool
        self._config = config
        self._range = np.repeat([config.moment_range, config.force_range], 3)
        self._resolution = np.repeat([config.moment_resolution, config.force_resolution], 3)
        self._noise = np.repeat([config.moment_noise, config.force_noise], 3)
        self._declare_inputs()
        self._held = self.DeclareDiscreteState(6)
        self._filtered = self.DeclareDiscreteState(6)
        self._peak = self.DeclareDiscreteState(6)
        self._count = self.DeclareDiscreteState(1)
        self.DeclareVectorOutputPort(
            "wrench", 6, self._calc_wrench, {self.discrete_state_ticket(self._held)}
        )
        self.DeclareVectorOutputPort("wrench_true", 6, self._calc_true)
        self.DeclareVectorOutputPort(
            "peak_reading", 6, self._calc_peak, {self.discrete_state_ticket(self._peak)}
        )
        # Without offset, so that its instants are those of the plant's steps to the last bit.
        self.DeclarePeriodicDiscreteUpdateEvent(config.period, 0.0, self._sample)

    def _declare_inputs(self) -> None:
        def declare(name: str, element: type) -> None:
            self.DeclareAbstractInputPort(name, AbstractValue.Make([element()]))

        declare("reaction_forces", SpatialForce)
        declare("body_poses", RigidTransform)
        declare("body_spatial_velocities", SpatialVelocity)
        declare("body_spatial_accelerations", SpatialAcceleration)
        self.DeclareVectorInputPort("reference_motion", frame_motion_vector())

    def _calc_wrench(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state(self._held).value())

    def _calc_peak(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state(self._peak).value())

    def _calc_true(self, context: Context, output: BasicVector) -> None:
        started = context.get_discrete_state(self._count).value()[0] > 1
        output.SetFromVector(
            self._contact_wrench(context, self._reaction(context)) if started else np.zeros(6)
        )

    def _sample(self, context: Context, state: DiscreteValues) -> None:
        count = int(context.get_discrete_state(self._count).value()[0])
        state.set_value(self._count, [count + 1.0])
        if count == 0:
            return  # the plant has not stepped yet
        raw = self._reaction(context) + self._config.bias + self._noise_at(count)
        self._report_range(context, state, raw)
        reading = self._filter(context, self._clipped(self._quantised(raw)), count)
        state.set_value(self._filtered, reading)
        state.set_value(self._held, self._contact_wrench(context, reading))

    def _reaction(self, context: Context) -> Array:
        """Returns the reaction [moment; force] on the tool about So, in S."""
        forces = self.GetInputPort("reaction_forces").Eval(context)
        reaction: Array = self._mounting.sign * forces[int(self._mounting.joint)].get_coeffs()
        check_signal(reaction, f"{self.get_name()}:reaction_forces")
        return reaction

    def _noise_at(self, count: int) -> Array:
        """Returns the noise of a sample: a function of seed and count, so it needs no state."""
        if not self._noise.any():
            return np.zeros(6)
        bits = np.random.Philox(key=self._config.seed, counter=[0, 0, 0, count])
        return self._noise * np.random.Generator(bits).standard_normal(6)

    def _quantised(self, reading: Array) -> Array:
        if not self._resolution.any():
            return reading
        step = np.where(self._resolution > 0, self._resolution, 1.0)
        return np.where(self._resolution > 0, np.round(reading / step) * step, reading)

    def _clipped(self, reading: Array) -> Array:
        return np.clip(reading, -self._range, self._range)

    def _report_range(self, context: Context, state: DiscreteValues, raw: Array) -> None:
        """Keeps the peak reading; says so the first time that an axis leaves its range."""
        before = context.get_discrete_state(self._peak).value()
        peak = np.maximum(before, np.abs(raw) / self._range)
        state.set_value(self._peak, peak)
        for axis in np.flatnonzero((before <= 1.0) & (peak > 1.0)):
            _log.warning(
                f"{self.get_name()} saturates at t = {context.get_time():.3f} s: {_AXES[axis]} is "
                f"{raw[axis]:.1f}, the range is ±{self._range[axis]:g}; the reading is clipped."
            )

    def _filter(self, context: Context, reading: Array, count: int) -> Array:
        """Returns the first-order low-pass of the readings; the first passes through."""
        cutoff = self._config.filter_cutoff
        if cutoff == 0 or count == 1:
            return reading
        before = context.get_discrete_state(self._filtered).value()
        gain = -np.expm1(-2 * np.pi * cutoff * self._config.period)
        return before + gain * (reading - before)

    def _contact_wrench(self, context: Context, reading: Array) -> Array:
        """Returns h in W about Eo from a reading in S: the tool's load removed, moved to E."""
        X_WT = self.GetInputPort("body_poses").Eval(context)[int(self._mounting.tool_body)]
        X_WS = X_WT @ self._mounting.X_TS
        R_WS = X_WS.rotation().matrix()
        p_WE = X_WT @ self._mounting.X_TE.translation()
        p_SC = R_WS @ self._tool.centre_of_mass
        a_WC, w_WT, dw_WT = self._tool_acceleration(context, X_WS.translation() + p_SC)
        load_moment, load_force = sensed_wrench.load_of_tool(
            self._tool.mass,
            p_SC,
            R_WS @ self._tool.inertia @ R_WS.T,
            self._mounting.gravity,
            a_WC,
            w_WT,
            dw_WT,
        )
        force = R_WS @ reading[3:] - load_force
        moment = R_WS @ reading[:3] - load_moment
        p_SE = p_WE - X_WS.translation()
        return np.concatenate((sensed_wrench.shifted_moment(moment, force, p_SE), force))

    def _tool_acceleration(self, context: Context, p_WC: Array) -> tuple[Array, Array, Array]:
        """Returns a_WC, ω, ω̇ of the tool as far as its inertial load is to be removed."""
        if self._config.inertial_load == "plant":
            index = int(self._mounting.tool_body)
            p_WP = self.GetInputPort("body_poses").Eval(context)[index].translation()
            V = self.GetInputPort("body_spatial_velocities").Eval(context)[index]
            A = self.GetInputPort("body_spatial_accelerations").Eval(context)[index]
            w, dw, a_WP = V.rotational(), A.rotational(), A.translational()
        elif self._config.inertial_load == "reference":
            motion = self.GetInputPort("reference_motion").Eval(context)
            check_frame_motion(motion, f"{self.get_name()}:reference_motion")
            p_WP, w = motion[POSITION], motion[ANGULAR_VELOCITY]
            dw, a_WP = motion[ANGULAR_ACCELERATION], motion[LINEAR_ACCELERATION]
        else:
            return np.zeros(3), np.zeros(3), np.zeros(3)
        return sensed_wrench.inertial_acceleration(a_WP, w, dw, p_WC - p_WP), w, dw
