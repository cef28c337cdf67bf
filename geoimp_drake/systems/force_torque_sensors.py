"""Several wrist sensors of one plant as one system: its reaction forces are read once."""

from collections.abc import Sequence

from pydrake.systems.framework import Context, DiscreteValues, State

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.wrist_sensing import PlantPorts, WristSensing
from geoimp_drake.systems.wrist_sensor_config import WristSensor

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
        mountings = [sensor.mounting for sensor in sensors]
        states = {mounting.num_states for mounting in mountings if mounting.path is not None}
        self._ports = PlantPorts.of(self, max(states, default=None))
        self._sensings = [
            WristSensing(
                self, sensor, self._ports, reference_is_held=reference_is_held, suffix=suffix
            )
            for sensor, suffix in zip(sensors, suffixes, strict=True)
        ]
        # How many samples there have been, and the last reading of each sensor.
        self._memory = self.declare_state(1 + 6 * len(sensors))
        self._places = [slice(1 + 6 * k, 7 + 6 * k) for k in range(len(sensors))]
        for sensing in self._sensings:
            sensing.declare_outputs(self._memory)
        period = sensors[0].config.period
        # Without offset, so that its instants are those of the plant's steps to the last bit.
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._sample)
        if any(sensing.keeps_reference for sensing in self._sensings):
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
        forces, port = self._ports.forces.Eval(context), self._ports.state
        plant_state = None if port is None else port.Eval(context)
        for sensing, place in zip(self._sensings, self._places, strict=True):
            sensing.sample(context, state, count, forces, plant_state, memory[place])

    def _keep_references(self, context: Context, state: State) -> None:
        for sensing in self._sensings:
            if sensing.keeps_reference:
                sensing.keep_reference(context, state)
