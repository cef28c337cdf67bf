"""A wrist force sensor in one line: from a weld joint of any plant to the wrench signal."""

from collections.abc import Sequence

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    Frame,
    JacobianWrtVariable,
    Joint,
    ModelInstanceIndex,
    RigidBody,
    WeldJoint,
)
from pydrake.systems.framework import DiagramBuilder, System

from geoimp_drake.arm.friction_inertia import friction_inertia
from geoimp_drake.arm.kinematic_tree import (
    KinematicTree,
    moving_joints_beyond,
    path_to,
    welded_bodies,
)
from geoimp_drake.controllers.sensor_checks import warn_of_sensed_inertia
from geoimp_drake.errors import ModelError
from geoimp_drake.laws.sensing.sensed_inertia import SensedInertia
from geoimp_drake.parts.wrist_sensor_config import (
    SensorMounting,
    ToolLoad,
    WristSensor,
    WristSensorConfig,
)
from geoimp_drake.parts.wrist_sensors import PLANT_LISTS
from geoimp_drake.rotations.so3 import skew
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
    its input port `reference_motion` yourself: for example to a controller's `compliant_motion`, or
    with `reference_is_held` to its `last_compliant_motion`, which costs less. For two arms that
    hold an object see `add_wrist_sensors`.

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
        ModelError: the plant is not finalized, the joint is not a weld of it, or E is not fixed
            beyond the joint.
        ConfigurationError: a field of the configuration cannot be used.
    """
    sensor = wrist_sensor_at(plant, joint, end_effector_frame, config, tool, initial_wrench)
    warn_of_sensed_inertia(sensor)
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
    for sensor in sensors:
        warn_of_sensed_inertia(sensor)
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
        ModelError: the plant is not finalized, the joint is not a weld of it, or E is not fixed
            beyond the joint.
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
    _check_fixed(plant, joint, end_effector_frame)
    T = welded_bodies(plant, joint)[0]
    context = plant.CreateDefaultContext()
    mounting = SensorMounting(
        # Reaction forces are in this order, also in a plant from which joints have been removed.
        joint=plant.GetJointIndices().index(joint.index()),
        tool_body=T.index(),
        X_TS=joint.frame_on_child().CalcPose(context, T.body_frame()),
        X_TE=end_effector_frame.CalcPose(context, T.body_frame()),
        gravity=_gravity(plant, T),
        sign=1.0 if T.index() == joint.child_body().index() else -1.0,
        path=path_to(plant, T.body_frame()),
        num_states=plant.num_multibody_states(),
        joint_name=_scoped_name(joint),
        end_effector=end_effector_frame.scoped_name().get_full(),
    )
    load = tool or tool_load_beyond(plant, joint)
    return WristSensor(
        mounting,
        load,
        config or WristSensorConfig(),
        initial_wrench,
        name,
        _sensed_inertia(plant, mounting, load),
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
    """Returns ARM_JOINT: with the model instance, joints of different arms have different names."""
    arm = joint.GetParentPlant().GetModelInstanceName(joint.model_instance())
    return f"{arm}_{joint.name()}"


def _check_fixed(plant: MultibodyPlant, joint: Joint, E: Frame) -> None:
    """Raises ModelError unless a frame moves with the body on a weld's far side."""
    moving = moving_joints_beyond(plant, joint, E)
    if moving == []:
        return
    tree = KinematicTree(plant, set())
    fixed = tree.carried_by(tree.far_side(joint).index(), through_joints=False)
    between = ""
    if moving:
        names = ", ".join(f"'{further.name()}'" for further in moving)
        between = f" ({names} move between them)"
    raise ModelError(
        f"Frame '{E.name()}' is not fixed beyond joint '{joint.name()}'{between}: the sensor "
        "would not measure the wrench on this frame alone. Fixed beyond it are frames on these "
        "bodies: "
        f"{', '.join(sorted(body.name() for body in fixed))}."
    )


def _sensed_inertia(
    plant: MultibodyPlant, mounting: SensorMounting, load: ToolLoad
) -> SensedInertia:
    """Returns what a sensor carries and the arm that moves it, in the plant's default posture."""
    context, W = plant.CreateDefaultContext(), plant.world_frame()
    body, p_TE = plant.get_body(mounting.tool_body), mounting.X_TE.translation()
    J = plant.CalcJacobianSpatialVelocity(
        context, JacobianWrtVariable.kV, body.body_frame(), p_TE, W, W
    )
    B = plant.CalcMassMatrix(context)
    for joint in map(plant.get_joint, plant.GetJointIndices()):
        for k, added in enumerate(friction_inertia(plant, joint), joint.velocity_start()):
            B[k, k] += added
    X_WT = body.EvalPoseInWorld(context)
    X_WS, X_WE = X_WT @ mounting.X_TS, X_WT @ mounting.X_TE
    R_WS, p_EC = X_WS.rotation().matrix(), X_WS @ load.centre_of_mass - X_WE.translation()
    lever = load.mass * skew(p_EC)
    inertia = R_WS @ load.inertia @ R_WS.T - lever @ skew(p_EC)
    M_t = np.block([[inertia, lever], [lever.T, load.mass * np.eye(3)]])
    mobility = J @ np.linalg.pinv(B, hermitian=True) @ J.T  # joints without mass make B singular
    return SensedInertia(mobility, M_t, X_WE.rotation().matrix(), plant.time_step())


def _gravity(plant: MultibodyPlant, tool: RigidBody) -> Array:
    enabled = plant.is_gravity_enabled(tool.model_instance())
    return plant.gravity_field().gravity_vector() * float(enabled)
