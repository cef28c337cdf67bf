"""Wrist force/torque sensors: from weld joints' reaction forces to the wrench h of the laws."""

from collections.abc import Sequence

from geoimp_drake.parts.wrist_sensor_config import (
    SensorMounting,
    ToolLoad,
    WristSensor,
    WristSensorConfig,
)
from geoimp_drake.parts.wrist_sensors import WristSensors
from geoimp_drake.systems.part_system import PartSystem
from geoimp_drake.typing import Array

__all__ = ["ForceTorqueSensor", "ForceTorqueSensors"]


class ForceTorqueSensor(PartSystem):
    """Measures the wrench that the end effector exerts on its environment.

    The reaction force of a weld joint carries the tool's weight and inertia besides the contact
    wrench. With the load of the tool alone (laws/sensed_wrench.py) removed,

        f = f_S − m (a_C − g),   μ = μ_S − (p_SC × m (a_C − g) + I ω̇ + ω × I ω) − p_SE × f,

    is the wrench of (2.2): by the end effector on the environment, about E's origin, in W. The
    reading is made in the sensor's axes and in this order: bias, noise, quantisation, saturation,
    low-pass filter; then the tool's load is removed. With a delay, the reading, with its bias and
    noise, is that of an earlier sample; until there is one, it is the first.

    It is sampled, which breaks the algebraic loop wrench → torque → wrench. A plant has no reaction
    forces before its first step, so the first sample that counts is one period after the start.
    Until then the wrench is `initial_wrench`, the known load of the hand; it is zero unless given.

    The reference motion is read when a discrete plant begins its step: a reaction belongs to the
    motion that this step followed.

    Args:
        mounting: where the sensor sits.
        tool: mass, centre of mass and inertia beyond the sensor, in S.
        config: sampling, errors and range of the sensor.
        initial_wrench: h until the first sample (6) [Nm, N].
        reference_is_held: whether the reference comes from a state that holds what the plant's last
            step followed, such as `last_compliant_motion`. It then need not be read before the
            step.

    Raises:
        ConfigurationError: a field of the configuration cannot be used.
        SignalError: a reaction force or the reference is NaN or infinite.

    Ports:
        input reaction_forces: the plant's reaction forces, list of SpatialForce
        input body_poses: the plant's body poses, list of RigidTransform
        input body_spatial_velocities: for `inertial_load: plant`, list of SpatialVelocity
        input body_spatial_accelerations: for the same, list of SpatialAcceleration
        input state: [q; v] of the plant, read instead of `body_poses`, which costs more (2n)
        input reference_motion: for `inertial_load: reference`, the motion that E follows (19)
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
        sensor = WristSensor(mounting, tool, config, initial_wrench)
        super().__init__(WristSensors([sensor], reference_is_held=reference_is_held, suffixes=[""]))


class ForceTorqueSensors(PartSystem):
    """Measures the wrenches of several hands: a `ForceTorqueSensor` for each, as one system.

    A plant gives the reaction forces of all its joints as one list. In Python that list costs more
    than the sensor's own work, so sensors of one plant that read at the same instants share it. The
    numbers are those of separate sensors.

    Args:
        sensors: of one plant, in order; their periods are the same.
        reference_is_held: see `ForceTorqueSensor`.

    Raises:
        ConfigurationError: a field cannot be used, the periods differ or there is no sensor.
        SignalError: a reaction force or a reference is NaN or infinite.

    Ports:
        input reaction_forces: the plant's reaction forces, list of SpatialForce
        input body_poses: the plant's body poses, list of RigidTransform
        input body_spatial_velocities: for `inertial_load: plant`, list of SpatialVelocity
        input body_spatial_accelerations: for the same, list of SpatialAcceleration
        input state: [q; v] of the plant, read instead of `body_poses`, which costs more (2n)
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

    def __init__(self, sensors: Sequence[WristSensor], *, reference_is_held: bool = False):
        super().__init__(WristSensors(sensors, reference_is_held=reference_is_held))
