"""A wrist force sensor in one line: from a weld joint of any plant to the wrench signal."""

from collections.abc import Sequence

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, ModelInstanceIndex, RigidBody, WeldJoint
from pydrake.systems.framework import DiagramBuilder, System

from geoimp_drake.arm.kinematic_tree import path_to, welded_bodies
from geoimp_drake.errors import ModelError
from geoimp_drake.parts.wrist_sensor_config import (
    SensorMounting,
    ToolLoad,
    WristSensor,
    WristSensorConfig,
)
from geoimp_drake.parts.wrist_sensors import PLANT_LISTS
from geoimp_drake.systems.naming import unused_name
from geoimp_drake.systems.sensing.force_torque_sensor import ForceTorqueSensor, ForceTorqueSensors
from geoimp_drake.typing import Array

__all__ = [
    "add_wrist_sensor",
    "add_wrist_sensors",
    "connect_wrist_sensors",
    "tool_load_beyond",
    "wrist_sensor_at",
]


def add_wrist_sensor(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    joint: Joint,
    end_effector_frame: Frame,
    config: WristSensorConfig | None = None,
    tool: ToolLoad | None = None,
    initial_wrench: Array | None = None,
    *,
    reference_is_held: bool = False,
) -> ForceTorqueSensor:
    """Adds a force/torque sensor that reads a weld joint of `plant`, connected to the plant.

    Its output port `wrench` is an input of the controllers. With `inertial_load: reference` connect
    its input port `reference_motion` yourself: to a controller's `compliant_motion`, say, or with
    `reference_is_held` to its `last_compliant_motion`, which costs less. For two arms that hold an
    object see `add_wrist_sensors`.

    Args:
        builder: holds `plant` already.
        plant: this and the following five are those of `wrist_sensor_at`.
        joint: see there.
        end_effector_frame: see there.
        config: see there.
        tool: see there.
        initial_wrench: see there.
        reference_is_held: see `ForceTorqueSensor`.

    Returns:
        The sensor, named ARM_JOINT_sensor after the joint and its model instance; where a system
        has that name already, with a number.

    Raises:
        ModelError: the joint is not a weld, or E is not fixed beyond it.
        ConfigurationError: a field of the configuration cannot be used.
    """
    sensor = wrist_sensor_at(plant, joint, end_effector_frame, config, tool, initial_wrench)
    system = builder.AddNamedSystem(
        unused_name(builder, f"{_scoped_name(joint)}_sensor"),
        ForceTorqueSensor(
            sensor.mounting,
            sensor.tool,
            sensor.config,
            sensor.initial_wrench,
            reference_is_held=reference_is_held,
        ),
    )
    connect_wrist_sensors(builder, plant, system)
    return system


def add_wrist_sensors(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    sensors: Sequence[WristSensor],
    *,
    reference_is_held: bool = False,
) -> ForceTorqueSensors:
    """Adds several force/torque sensors as one system, connected to the plant: it costs less.

    Its output ports `wrench_1`, `wrench_2` and so on are inputs of `make_cooperative_controller`.
    With `inertial_load: reference` connect its input ports `reference_motion_1` and so on yourself:
    with `reference_is_held` to the controller's `last_reference_motion_1` and so on. It costs less
    to give the sensors to that controller, see `connect_wrist_sensors`.

    Args:
        builder: holds `plant` already.
        plant: finalized.
        sensors: of `wrist_sensor_at`; their periods are the same.
        reference_is_held: see `ForceTorqueSensor`.

    Returns:
        The system, named wrist_sensors; where there is one already, with a number.

    Raises:
        ConfigurationError: a field of a configuration cannot be used, or the periods differ.
    """
    system = builder.AddNamedSystem(
        unused_name(builder, "wrist_sensors"),
        ForceTorqueSensors(sensors, reference_is_held=reference_is_held),
    )
    connect_wrist_sensors(builder, plant, system)
    return system


def connect_wrist_sensors(builder: DiagramBuilder, plant: MultibodyPlant, system: System) -> None:
    """Connects the plant's outputs that wrist sensors read to a system that contains some.

    Args:
        builder: holds both already.
        plant: finalized.
        system: `ForceTorqueSensors`, or a controller that was given sensors.
    """
    for name in PLANT_LISTS:
        if system.HasInputPort(name):
            builder.Connect(plant.GetOutputPort(name), system.GetInputPort(name))
    if system.HasInputPort("state"):
        builder.Connect(plant.get_state_output_port(), system.GetInputPort("state"))


def wrist_sensor_at(
    plant: MultibodyPlant,
    joint: Joint,
    end_effector_frame: Frame,
    config: WristSensorConfig | None = None,
    tool: ToolLoad | None = None,
    initial_wrench: Array | None = None,
    name: str = "",
) -> WristSensor:
    """Returns the description of a sensor that reads a weld joint of `plant`.

    Args:
        plant: finalized.
        joint: the weld between the hand's mounting and the tool.
        end_effector_frame: E, fixed beyond the joint.
        config: sampling, errors and range; the default is an ideal sensor read every 1 ms.
        tool: the load to remove; by default that of every body beyond the joint, from the plant.
        initial_wrench: h until the first sample, one period after the start (6); zero unless given.
        name: in warnings; that of the sensor's system if empty.

    Raises:
        ModelError: the joint is not a weld, or E is not fixed beyond it.
    """
    if not plant.is_finalized():
        raise ModelError("The plant is not finalized; call plant.Finalize() first.")
    if not isinstance(joint, WeldJoint):
        raise ModelError(
            f"Joint '{joint.name()}' is of type '{joint.type_name()}'; a wrist sensor reads a weld "
            f"joint. In a URDF that is a joint of type 'fixed'."
        )
    if joint.GetParentPlant() is not plant or end_effector_frame.GetParentPlant() is not plant:
        raise ModelError(
            f"Joint '{joint.name()}' or frame '{end_effector_frame.name()}' belongs to another "
            f"plant; get them with plant.GetJointByName() and plant.GetFrameByName()."
        )
    carried_bodies = welded_bodies(plant, joint)
    T, carried = carried_bodies[0], {body.index() for body in carried_bodies}
    if end_effector_frame.body().index() not in carried:
        raise ModelError(
            f"Frame '{end_effector_frame.name()}' is not fixed beyond joint '{joint.name()}': the "
            f"sensor would not feel what happens there. Frames on these bodies are: "
            f"{', '.join(sorted(plant.get_body(index).name() for index in carried))}."
        )
    context = plant.CreateDefaultContext()
    mounting = SensorMounting(
        # The plant orders its reaction forces so, whatever joints have been removed from it.
        joint=plant.GetJointIndices().index(joint.index()),
        tool_body=T.index(),
        X_TS=joint.frame_on_child().CalcPose(context, T.body_frame()),
        X_TE=end_effector_frame.CalcPose(context, T.body_frame()),
        gravity=_gravity(plant, T),
        sign=1.0 if T.index() == joint.child_body().index() else -1.0,
        path=path_to(plant, T.body_frame()),
        num_states=plant.num_multibody_states(),
    )
    return WristSensor(
        mounting,
        tool or tool_load_beyond(plant, joint),
        config or WristSensorConfig(),
        initial_wrench,
        name,
    )


def tool_load_beyond(
    plant: MultibodyPlant, joint: Joint, without: Sequence[ModelInstanceIndex] = ()
) -> ToolLoad:
    """Returns mass, centre of mass and inertia of all that a weld joint carries, in its frame S.

    Args:
        plant: finalized.
        joint: the weld.
        without: model instances that hang there but are to stay in the measured wrench, such as an
            object that the hand carries.
    """
    context = plant.CreateDefaultContext()
    S = joint.frame_on_child()
    bodies = [body.index() for body in welded_bodies(plant, joint, without)]
    M_SSo_S = plant.CalcSpatialInertia(context, S, bodies)
    if M_SSo_S.get_mass() == 0:
        return ToolLoad()
    p_SC = M_SSo_S.get_com()
    # Moved to the centre of mass, the inertia there is what is left.
    inertia = M_SSo_S.Shift(p_SC).CalcRotationalInertia().CopyToFullMatrix3()
    return ToolLoad(mass=M_SSo_S.get_mass(), centre_of_mass=p_SC, inertia=inertia)


def _scoped_name(joint: Joint) -> str:
    """Returns the name of a joint after that of its model instance, which the arms differ in."""
    arm = joint.GetParentPlant().GetModelInstanceName(joint.model_instance())
    return f"{arm}_{joint.name()}"


def _gravity(plant: MultibodyPlant, tool: RigidBody) -> Array:
    enabled = plant.is_gravity_enabled(tool.model_instance())
    return plant.gravity_field().gravity_vector() * float(enabled)
