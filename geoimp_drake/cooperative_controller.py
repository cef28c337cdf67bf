"""Two arms that hold one object as one Diagram: the object, not the hands, gets the impedance."""

from collections.abc import Sequence

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort, System

from geoimp_drake.config import RedundancyConfig
from geoimp_drake.control_model import ControlModel
from geoimp_drake.cooperative_config import CooperativeControllerConfig
from geoimp_drake.errors import ConfigurationError, ModelError
from geoimp_drake.systems.arm_model import ArmModel
from geoimp_drake.systems.cooperative_kinematics import CooperativeKinematics
from geoimp_drake.systems.cooperative_reference_generator import CooperativeReferenceGenerator
from geoimp_drake.systems.inverse_dynamics_inner_loop import InverseDynamicsInnerLoop
from geoimp_drake.systems.reference_hold import ReferenceHold
from geoimp_drake.task_functions.task_function import TaskFunction

__all__ = ["make_cooperative_controller"]


def make_cooperative_controller(
    plant: MultibodyPlant,
    model_instances: Sequence[ModelInstanceIndex],
    end_effector_frames: Sequence[Frame],
    config: CooperativeControllerConfig | None = None,
    *,
    loads: Sequence[ModelInstanceIndex] = (),
    task_functions: Sequence[TaskFunction | None] = (None, None),
) -> Diagram:
    """Makes a controller of two arms of `plant` that hold one object tightly.

    The object behaves as a mass, damper and spring about the desired motion: by (3.1) and (3.30),
    or the orientation family of the configuration. The hands follow the references (4.10)-(4.15);
    unless switched off, an impedance on the internal wrench bounds the squeezing, and both hands
    come to rest when a grasp opens.

    ```
    desired_motion ─────────────▶ impedance ──C──▶ references ─▶ hold ─▶ arm_1, arm_2 ─▶ actuation
                     object ▲ wrench ▲ motion       ▲ mutual      ▲          ▲
    wrench_1, _2 ──▶ kinematics ─────┘     internal_impedance   monitor      │
                       ▲      └─ internal wrench ──▶┘             ▲          │
                       │                                     wrench_1, _2    │
    estimated_state_1, _2 ─▶ joint_readings ─▶ arm_model ────────────────────┘
    ```

    Each arm is controlled as a single one is, see `make_impedance_controller`, with its own wrench
    in (2.3), the load that it carries included; the object's weight and inertial load are removed
    from the impedance's wrench alone. The object's frame O (4.1), (4.4) is halfway between the
    end-effector frames, which may be any frames fixed in the hands; C starts at rest on its
    measured pose, so place the desired motion by `object_motion`.

    Args:
        plant: finalized, contains both arms at any base poses; what else it contains is ignored.
        model_instances: the two arms, six or more joints each with an actuator each.
        end_effector_frames: E of each arm, in the same order.
        config: gains, grasp, object and sampling.
        loads: model instances that hang on a hand but are not part of its arm's model: their weight
            stays in the measured wrench.
        task_functions: of redundant arms, in the place of the configured ones.

    Returns:
        A Diagram with these ports.

        input estimated_state_1: [q; v] of the first arm of n joints, in the plant's order (2n)
        input estimated_state_2: the same of the second (2n)
        input desired_motion: of D, the object's, in W, see `frame_motion` (19)
        input stiffness_scale: factors of K_p and K_o, one each if not connected (2)
        input wrench_1: h = [μ; f] by the first hand on its environment, about Eo, in W (6)
        input wrench_2: the same by the second (6)
        output compliant_motion: of C, the object's, in W (19)
        output displacement: of D from C: [orientation displacement; Δp_dc] (6)
        output energy: energies and powers of the impedance, `ImpedanceEnergy` (9)
        output object_motion: of O in W as the joint readings tell; accelerations are zero (19)
        output object_wrench: by the object on its environment, about Oo, in W (6)
        output internal_wrench: ½(h_2 − h_1), in W (6)
        output mutual_motion: the measured mutual pose, see `CooperativeKinematics` (19)
        output mutual_reference: the grasp's mutual pose ¹Q_21, ᵒΔp_21 (19)
        output opened: which grasps have opened, and when, see `GraspMonitor` (3)
        output release: which grippers are to open, see `ReferenceHold` (2)
        output reference_motion_1: what the first hand follows, in W (19)
        output actuation_1: torques in the order of the first arm's actuators (n) [Nm or N]
        output measured_motion_1: of the first hand as the readings tell; no accelerations (19)
        output peak_effort_1: largest torque so far as a fraction of the limit (n)
        output reference_motion_2: the same of the second (19)
        output actuation_2: the same of the second (n)
        output measured_motion_2: the same of the second (19)
        output peak_effort_2: the same of the second (n)

        With the monitor switched off there are no ports `opened` and `release`.

    Raises:
        ModelError: the plant does not contain such arms.
        ConfigurationError: the configuration cannot be used.
    """
    config = config or CooperativeControllerConfig()
    config.validate()
    models = _models(plant, model_instances, end_effector_frames, loads)
    builder = DiagramBuilder()
    arms = _add_arms(builder, config, models, task_functions)
    kinematics = builder.AddNamedSystem(
        "kinematics",
        CooperativeKinematics(config.load, plant.gravity_field().gravity_vector(), config.wrench),
    )
    impedance = builder.AddNamedSystem("impedance", config.impedance.make())
    references = builder.AddNamedSystem(
        "references", CooperativeReferenceGenerator(config.mutual_pose)
    )
    for k, arm in enumerate(arms, 1):
        # O and its wrench are those of the hands; the grasp starts as they are.
        _connect(builder, arm, "measured_motion", kinematics, f"motion_{k}")
        _connect(builder, arm, "measured_motion", references, f"measured_motion_{k}")
    _connect(builder, references, "mutual_reference", kinematics, "mutual_reference")
    # The impedance is the single arm's, with O in the place of E.
    _connect(builder, kinematics, "object_motion", impedance, "measured_motion")
    _connect(builder, kinematics, "object_wrench", impedance, "wrench")
    _connect(builder, impedance, "compliant_motion", references, "compliant_motion")
    if config.load.mass > 0 and config.load.inertial_load == "compliant":
        # A reading of the sensors is of the plant's last step. That also breaks the loop
        # acceleration of C → wrench → acceleration of C.
        _connect(builder, impedance, "last_compliant_motion", kinematics, "reference_motion")
    if config.internal.enabled:
        _add_internal_impedance(builder, config, kinematics, references)
    _export_inputs(builder, arms, impedance, kinematics)
    for port in ("compliant_motion", "displacement", "energy"):
        builder.ExportOutput(impedance.GetOutputPort(port), port)
    for port in ("object_motion", "object_wrench", "internal_wrench", "mutual_motion"):
        builder.ExportOutput(kinematics.GetOutputPort(port), port)
    builder.ExportOutput(references.GetOutputPort("mutual_reference"), "mutual_reference")
    motions = [references.GetOutputPort(f"reference_motion_{k}") for k in (1, 2)]
    if config.monitor.enabled:
        motions = _add_monitor(builder, config, motions)
    for k, (arm, motion) in enumerate(zip(arms, motions, strict=True), 1):
        # The inner loops track the references in the place of D.
        builder.Connect(motion, arm.GetInputPort("reference_motion"))
        builder.ExportOutput(motion, f"reference_motion_{k}")
        for port in ("actuation", "measured_motion", "peak_effort"):
            builder.ExportOutput(arm.GetOutputPort(port), f"{port}_{k}")
    diagram = builder.Build()
    names = [plant.GetModelInstanceName(instance) for instance in model_instances]
    diagram.set_name(f"{'_'.join(names)}_cooperative_controller")
    return diagram


def _models(
    plant: MultibodyPlant,
    model_instances: Sequence[ModelInstanceIndex],
    frames: Sequence[Frame],
    loads: Sequence[ModelInstanceIndex],
) -> list[ControlModel]:
    if len(model_instances) != 2 or len(frames) != 2:
        raise ModelError(
            f"Two arms hold one object, but there are {len(model_instances)} model instances and "
            f"{len(frames)} end-effector frames; give two of each, in the same order."
        )
    if model_instances[0] == model_instances[1]:
        raise ModelError(
            f"Both arms are '{plant.GetModelInstanceName(model_instances[0])}'; give two."
        )
    return [
        ControlModel.of_arm(plant, instance, E, without=loads)
        for instance, E in zip(model_instances, frames, strict=True)
    ]


def _connect(
    builder: DiagramBuilder, source: System, output: str, target: System, port: str
) -> None:
    builder.Connect(source.GetOutputPort(output), target.GetInputPort(port))


def _add_arms(
    builder: DiagramBuilder,
    config: CooperativeControllerConfig,
    models: Sequence[ControlModel],
    task_functions: Sequence[TaskFunction | None],
) -> list[Diagram]:
    if len(task_functions) != 2:
        raise ConfigurationError(
            f"There are {len(task_functions)} task functions; give one for each of the two arms, "
            f"None for the configured one."
        )
    parts = (config.redundancy_1, config.redundancy_2)
    return [
        builder.AddNamedSystem(f"arm_{k}", _make_arm(model, config, redundancy, task))
        for k, model, redundancy, task in zip((1, 2), models, parts, task_functions, strict=True)
    ]


def _make_arm(
    model: ControlModel,
    config: CooperativeControllerConfig,
    redundancy_config: RedundancyConfig,
    task_function: TaskFunction | None,
) -> Diagram:
    """Returns the inner loop of one arm, that of `make_impedance_controller`.

    ```
    reference_motion ─▶ motion_control ─▶ redundancy ─▶ inverse_dynamics ─▶ actuation
                            ▲                 ▲            ▲      ▲
    estimated_state ─▶ joint_readings ─▶ arm_model ────────┘    wrench
    ```
    """
    builder = DiagramBuilder()
    readings = builder.AddNamedSystem("joint_readings", config.sampling.make(model.num_joints))
    arm = builder.AddNamedSystem("arm_model", ArmModel(model))
    motion = builder.AddNamedSystem("motion_control", config.motion.make())
    redundancy = builder.AddNamedSystem("redundancy", redundancy_config.make(model, task_function))
    torque = builder.AddNamedSystem(
        "inverse_dynamics", InverseDynamicsInnerLoop(model, config.sampling.period)
    )
    _connect(builder, readings, "estimated_state", arm, "state")
    for system in (motion, redundancy, torque):
        _connect(builder, arm, "arm", system, "arm")
    _connect(builder, motion, "task_acceleration", redundancy, "task_acceleration")
    _connect(builder, redundancy, "joint_acceleration", torque, "joint_acceleration")
    builder.ExportInput(readings.GetInputPort("state"), "estimated_state")
    builder.ExportInput(torque.GetInputPort("wrench"), "wrench")
    builder.ExportInput(motion.GetInputPort("reference_motion"), "reference_motion")
    builder.ExportOutput(torque.GetOutputPort("actuation"), "actuation")
    builder.ExportOutput(torque.GetOutputPort("peak_effort"), "peak_effort")
    builder.ExportOutput(arm.GetOutputPort("motion_E"), "measured_motion")
    return builder.Build()


def _add_internal_impedance(
    builder: DiagramBuilder,
    config: CooperativeControllerConfig,
    kinematics: System,
    references: System,
) -> None:
    """Lets the internal wrench move the mutual pose of the references."""
    internal = builder.AddNamedSystem(
        "internal_impedance", config.internal.make("internal", config.sampling.period)
    )
    _connect(builder, references, "mutual_reference", internal, "desired_motion")
    _connect(builder, kinematics, "mutual_wrench", internal, "wrench")
    _connect(builder, kinematics, "mutual_motion", internal, "measured_motion")
    _connect(builder, internal, "compliant_motion", references, "mutual_motion")


def _export_inputs(
    builder: DiagramBuilder, arms: Sequence[System], impedance: System, kinematics: System
) -> None:
    """Exports the inputs; the wrench of a hand goes to the object, and to its arm for (2.3)."""
    for k, arm in enumerate(arms, 1):
        builder.ExportInput(arm.GetInputPort("estimated_state"), f"estimated_state_{k}")
    for port in ("desired_motion", "stiffness_scale"):
        builder.ExportInput(impedance.GetInputPort(port), port)
    for k, arm in enumerate(arms, 1):
        builder.ExportInput(kinematics.GetInputPort(f"wrench_{k}"), f"wrench_{k}")
        builder.ConnectInput(f"wrench_{k}", arm.GetInputPort("wrench"))


def _add_monitor(
    builder: DiagramBuilder, config: CooperativeControllerConfig, motions: Sequence[OutputPort]
) -> list[OutputPort]:
    """Adds what watches the grasps and holds the hands; returns the motions to be tracked."""
    period = config.sampling.period
    monitor = builder.AddNamedSystem("grasp_monitor", config.monitor.make(period))
    hold = builder.AddNamedSystem("hold", ReferenceHold(config.opened, period))
    for k, motion in enumerate(motions, 1):
        builder.ConnectInput(f"wrench_{k}", monitor.GetInputPort(f"wrench_{k}"))
        builder.Connect(motion, hold.GetInputPort(f"reference_motion_{k}"))
    _connect(builder, monitor, "opened", hold, "opened")
    builder.ExportOutput(monitor.GetOutputPort("opened"), "opened")
    builder.ExportOutput(hold.GetOutputPort("release"), "release")
    return [hold.GetOutputPort(f"held_motion_{k}") for k in (1, 2)]
