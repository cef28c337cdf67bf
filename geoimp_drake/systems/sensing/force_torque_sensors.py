"""Several wrist sensors of one plant as one system: its reaction forces are read once."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from pydrake.systems.framework import BasicVector, Context, DiscreteValues, InputPort, State

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.frame_motion import frame_motion_vector
from geoimp_drake.systems.sensing.wrist_sensing import (
    WristSensing,
    declare_plant_ports,
    initial_wrench,
    read_plant,
)
from geoimp_drake.systems.sensing.wrist_sensor_config import WristSensor
from geoimp_drake.typing import Array

__all__ = ["ForceTorqueSensors"]


class ForceTorqueSensors(Block):
    """Measures the wrenches of several hands: a `ForceTorqueSensor` for each, as one system.

    A plant gives the reaction forces of all its joints as one list. In Python that list costs more
    than what a sensor does with it, so sensors of one plant that read at the same instants share
    it. The numbers are those of separate sensors.

    Args:
        sensors: of one plant, in order; their periods are the same.
        reference_is_held: see `ForceTorqueSensor`.
        suffixes: behind the names of each sensor's ports; by default _1, _2 and so on.

    Raises:
        ConfigurationError: a field cannot be used, the periods differ or there is no sensor.
        SignalError: a reaction force or a reference is NaN or infinite.

    Ports:
        input reaction_forces: the plant's reaction forces, list of SpatialForce
        input body_poses: the plant's body poses, list of RigidTransform
        input body_spatial_velocities: for `inertial_load: plant`, list of SpatialVelocity
        input body_spatial_accelerations: for the same, list of SpatialAcceleration
        input state: [q; v] of the plant, read in the place of `body_poses`, which costs more (2n)
        input reference_motion_1: for `inertial_load: reference`, the motion that E follows (19)
        input reference_motion_2: the same of the second (19)
        output wrench_1: measured wrench [moment; force] (6) [Nm, N]
        output wrench_true_1: the same before bias, noise, quantisation, range and filter (6)
        output peak_reading_1: largest reading since the start as a fraction of the range (6)
        output wrench_2: the same three of the second (6) [Nm, N]
        output wrench_true_2: see above (6)
        output peak_reading_2: see above (6)

        So for two sensors. Without a path to any tool there is no port `state`.
    """

    def __init__(
        self,
        sensors: Sequence[WristSensor],
        *,
        reference_is_held: bool = False,
        suffixes: Sequence[str] | None = None,
    ):
        super().__init__()
        if not sensors:
            raise ConfigurationError("There is no sensor; give at least one.")
        periods = {sensor.config.period for sensor in sensors}
        if len(periods) > 1:
            raise ConfigurationError(
                f"The sensors' periods are {sorted(periods)} s; sensors in one system need the "
                f"same. Add them one by one for different ones."
            )
        if suffixes is None:
            suffixes = [f"_{k}" for k in range(1, len(sensors) + 1)]
        self._ports = declare_plant_ports(self, sensors, all_of_them=True)
        self._hands = [
            _Hand.of(self, sensor, self._ports, reference_is_held, suffix)
            for sensor, suffix in zip(sensors, suffixes, strict=True)
        ]
        # How many samples there have been, and the last reading of each sensor.
        self._memory = self.declare_state(1 + 6 * len(sensors))
        self._places = [slice(1 + 6 * k, 7 + 6 * k) for k in range(len(sensors))]
        for hand, suffix in zip(self._hands, suffixes, strict=True):
            self.declare_state_output(f"wrench{suffix}", hand.held)
            calc = partial(self._calc_true, hand)
            self.DeclareVectorOutputPort(f"wrench_true{suffix}", 6, calc)
            self.declare_state_output(f"peak_reading{suffix}", hand.peak)
        period = sensors[0].config.period
        # Without offset, so that its instants are those of the plant's steps to the last bit.
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._sample)
        if any(hand.keeps_reference for hand in self._hands):
            # Unrestricted updates come first, together with the step of a plant with sampled output
            # ports: what the step has evaluated is not evaluated again.
            self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._keep_references)

    def _sample(self, context: Context, state: DiscreteValues) -> None:
        # Drake hands over a copy of the context's state.
        memory = state.get_mutable_value(self._memory)
        count = int(memory[0])
        memory[0] = count + 1.0
        if count == 0:
            return  # the plant has not stepped yet
        forces, plant_state = read_plant(self._ports, context)
        for hand, place in zip(self._hands, self._places, strict=True):
            hand.sensing.sample(
                context,
                count,
                forces,
                plant_state,
                hand.motion(context),
                partial(hand.last_peak, context),
                memory[place],
                state.get_mutable_value(hand.peak),
                state.get_mutable_value(hand.held),
            )

    def _calc_true(self, hand: "_Hand", context: Context, output: BasicVector) -> None:
        state = context.get_discrete_state()
        if state.value(self._memory)[0] > 1:
            output.SetFromVector(hand.sensing.true_wrench(context, hand.motion(context)))
        else:
            output.SetFromVector(state.value(hand.held))

    def _keep_references(self, context: Context, state: State) -> None:
        for hand in self._hands:
            if hand.keeps_reference:
                followed = state.get_mutable_discrete_state(hand.followed)
                followed.SetFromVector(hand.reference.Eval(context))


@dataclass(frozen=True, slots=True)
class _Hand:
    """One sensor, its port, and the groups of the state that are its own."""

    sensing: WristSensing
    reference: InputPort
    is_held: bool  # the reference is to be taken as it is
    keeps_reference: bool  # it is to be kept when a step begins
    held: int  # h
    peak: int
    followed: int  # the motion with which the tool's inertial load is removed

    @staticmethod
    def of(
        system: Block,
        sensor: WristSensor,
        ports: dict[str, InputPort],
        reference_is_held: bool,
        suffix: str,
    ) -> "_Hand":
        sensing = WristSensing(system, sensor, ports, suffix)
        return _Hand(
            sensing,
            system.DeclareVectorInputPort(f"reference_motion{suffix}", frame_motion_vector()),
            sensing.follows and reference_is_held,
            sensing.follows and not reference_is_held,
            system.declare_state(initial_wrench(sensor)),
            system.declare_state(6),
            # At rest, unless one is followed.
            system.declare_state(frame_motion_vector()),
        )

    def last_peak(self, context: Context) -> Array:
        """Returns the largest reading before this sample, as a fraction of the range (6)."""
        peak: Array = context.get_discrete_state(self.peak).value()
        return peak

    def motion(self, context: Context) -> Array:
        """Returns the motion with which the tool's inertial load is removed (19)."""
        # A copy: a law is compiled once more for an array that cannot be written to.
        motion: Array = (
            self.reference.Eval(context)
            if self.is_held
            else context.get_discrete_state(self.followed).CopyToVector()
        )
        return motion
