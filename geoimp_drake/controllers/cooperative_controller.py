"""Two arms that hold one object: the object, not the hands, gets the impedance."""

from collections.abc import Sequence

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex
from pydrake.systems.framework import DiagramBuilder, OutputPort, System

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.cooperative_config import CooperativeControllerConfig
from geoimp_drake.controllers.forms import connect_wrenches, make_compiled
from geoimp_drake.controllers.impedance_controller import GRAVITY
from geoimp_drake.controllers.inner_loop import InnerLoopParts, make_inner_loop
from geoimp_drake.controllers.internal_gains import make_internal
from geoimp_drake.controllers.object_loop import ObjectParts, add_object_loop
from geoimp_drake.controllers.sensor_checks import check_sensor
from geoimp_drake.errors import ConfigurationError, ModelError
from geoimp_drake.parts.two_arms import TwoArms
from geoimp_drake.parts.wrist_sensor_config import WristSensor
from geoimp_drake.parts.wrist_sensors import WristSensors
from geoimp_drake.systems.last_motion import LastMotion
from geoimp_drake.systems.naming import name_after_arms
from geoimp_drake.task_functions.task_function import TaskFunction
from geoimp_drake.validation import check, choice

__all__ = ["cooperative_parts", "make_cooperative_controller", "two_arms"]


def make_cooperative_controller(
    plant: MultibodyPlant,
    model_instances: Sequence[ModelInstanceIndex],
    end_effector_frames: Sequence[Frame],
    config: CooperativeControllerConfig | None = None,
    *,
    loads: Sequence[ModelInstanceIndex] = (),
    task_functions: Sequence[TaskFunction | None] = (None, None),
    sensors: Sequence[WristSensor] = (),
    gravity: str = "controller",
) -> System:
    """Makes a controller of two arms of `plant` that hold one object tightly.

    The object behaves as a mass, damper and spring about the desired motion: by (3.1) and (3.30),
    or the orientation family of the configuration. The hands follow the references (4.10)-(4.15).
    Unless switched off, an impedance on the internal wrench bounds the squeezing, and both hands
    come to rest when a grasp opens.

    ```
    desired_motion ─────────────▶ impedance ──C──▶ references ─▶ hold ─▶ arm_1, arm_2 ─▶ actuation
                     object ▲ wrench ▲ motion       ▲ mutual      ▲          ▲
    wrench_1, _2 ──▶ kinematics ─────┘     internal_impedance   monitor      │
                       ▲      └─ internal wrench ──▶┘             ▲          │
                       │                                     wrench_1, _2    │
    estimated_state_1, _2 ─▶ joint_readings ─▶ arm_model ────────────────────┘
    ```

    With `config.form` "blocks" it is a Diagram of these systems, with a Diagram for each arm. With
    "compiled" it is one system with the same ports and numbers, which takes less time: see
    `geoimp_drake.parts.two_arms`.

    Each arm is controlled as a single one, see `make_impedance_controller`. Its own wrench in (2.3)
    includes the load that it carries. The object's weight and inertial load are removed only from
    the impedance's wrench. The object's frame O (4.1), (4.4) is halfway between the end-effector
    frames, which may be any frames fixed in the hands. C starts at rest on its measured pose, so
    place the desired motion by `object_motion`.

    Args:
        plant: finalized, contains both arms at any base poses; what else it contains is ignored.
        model_instances: the two arms, six or more joints each with an actuator each.
        end_effector_frames: E of each arm, in the same order.
        config: gains, grasp, object and sampling. What the internal impedance leaves open follows
            from the arms in the plant's default positions, see `internal_gains`.
        loads: model instances that hang on a hand but are not part of its arm's model: their weight
            stays in the measured wrench.
        task_functions: of redundant arms, in place of the configured ones.
        sensors: of both wrists, in the same order, from `wrist_sensor_at` on the real plant. With
            them the controller reads the plant's reaction forces itself; connect it by
            `connect_wrist_sensors`.
        gravity: who holds the arms' weight, `controller`, or `robot` behind drivers that do.

    Returns:
        A system with these ports, named after both arms.

        input estimated_state_1: [q; v] of the first arm of n joints, in the plant's order (2n)
        input estimated_state_2: the same of the second (2n)
        input desired_motion: of D, the object's, in W, see `frame_motion` (19)
        input stiffness_scale: factors of K_p and K_o, one each if not connected (2)
        input wrench_1: h = [μ; f] by the first hand on its environment, about Eo, in W (6)
        input wrench_2: the same by the second (6)
        output compliant_motion: of C, the object's, in W (19)
        output displacement: of D from C: [orientation displacement; Δp_dc] (6)
        output energy: energies and powers of the impedance, `ImpedanceEnergy` (9)
        output object_motion: of O in W from the joint readings; accelerations are zero (19)
        output object_wrench: by the object on its environment, about Oo, in W (6)
        output internal_wrench: ½(h_2 − h_1), in W (6)
        output mutual_motion: the measured mutual pose, see `CooperativeKinematics` (19)
        output mutual_reference: the grasp's mutual pose ¹Q_21, ᵒΔp_21 (19)
        output reference_motion_1: what the first hand follows, in W (19)
        output reference_motion_2: what the second hand follows (19)
        output opened: which grasps have opened, and when, see `GraspMonitor` (3)
        output release: which grippers are to open, see `ReferenceHold` (2)
        output last_reference_motion_1: the first when the last step began; a held state (19)
        output last_reference_motion_2: the same of the second (19)
        output actuation_1: torques in the order of the first arm's actuators (n) [Nm or N]
        output measured_motion_1: of the first hand from the readings; no accelerations (19)
        output peak_effort_1: largest torque so far as a fraction of the limit (n)
        output actuation_2: the same of the second (n)
        output measured_motion_2: the same of the second (19)
        output peak_effort_2: the same of the second (n)
        output limited_1: effect of its limits since the last step began, `Limited` (10)
        output limited_2: the same of the second (10)

        With null for limits there are no ports `limited_1` and `limited_2`. With `config.remedies`
        there are outputs `compensation_1` and `compensation_2`, which `actuation_1` and `_2`
        contain: see `systems.arm.remedies`.

        With the monitor switched off there are no ports `opened` and `release`. With sensors,
        inputs for the plant's outputs (`reaction_forces`, `state` and what else they read) replace
        `wrench_1` and `wrench_2`. Then there are outputs `wrench_1`, `wrench_true_1` and
        `peak_reading_1` as `ForceTorqueSensors` has them, and those of the second sensor. They
        replace `last_reference_motion_1` and `_2`, which are for sensors beside the controller.

    Raises:
        ModelError: the plant does not contain such arms.
        ConfigurationError: the configuration cannot be used, or there are not two sensors.
    """
    config = config or CooperativeControllerConfig()
    if sensors and len(sensors) != 2:
        raise ConfigurationError(f"There are {len(sensors)} sensors; give one per hand, or none.")
    held, arms = cooperative_parts(
        plant,
        model_instances,
        end_effector_frames,
        config,
        loads=loads,
        task_functions=task_functions,
        gravity=gravity,
    )
    compiles = config.form == "compiled"
    wrists = None
    for sensor, E in zip(sensors, end_effector_frames, strict=bool(sensors)):
        check_sensor(sensor, E, config.impedance, config.motion, config.sampling, hands=2)
    if sensors:
        wrists = WristSensors(sensors, reference_is_held=compiles, all_of_them=False)
    if compiles:
        controller: System = make_compiled(two_arms(held, arms, wrists))
    else:
        controller = _of_blocks(held, arms, wrists)
    controller.set_name(name_after_arms(plant, model_instances, "cooperative_controller"))
    return controller


def cooperative_parts(
    plant: MultibodyPlant,
    model_instances: Sequence[ModelInstanceIndex],
    end_effector_frames: Sequence[Frame],
    config: CooperativeControllerConfig,
    *,
    loads: Sequence[ModelInstanceIndex] = (),
    task_functions: Sequence[TaskFunction | None] = (None, None),
    gravity: str = "controller",
) -> tuple[ObjectParts, list[InnerLoopParts]]:
    """Returns the parts of the blocks; arguments and errors are those of the controller.

    Args:
        plant: this and the following six are those of `make_cooperative_controller`.
        model_instances: see there.
        end_effector_frames: see there.
        config: see there.
        loads: see there.
        task_functions: see there.
        gravity: see there.
    """
    check(config)
    choice(gravity, "gravity", GRAVITY)
    if len(task_functions) != 2:
        raise ConfigurationError(
            f"There are {len(task_functions)} task functions; give one for each of the two arms, "
            f"None for the configured one."
        )
    models = _models(plant, model_instances, end_effector_frames, loads, gravity)
    internal = make_internal(config, models) if config.internal.enabled else None
    held = ObjectParts.of(config, plant.gravity_field().gravity_vector(), internal)
    redundancies = config.redundancy_1, config.redundancy_2
    kept = config.limits, config.impedance.masses()
    return held, [
        InnerLoopParts.of(
            model, config.motion, config.sampling, redundancy, *kept, task, config.remedies
        )
        for model, redundancy, task in zip(models, redundancies, task_functions, strict=True)
    ]


def two_arms(
    held: ObjectParts, arms: Sequence[InnerLoopParts], wrists: WristSensors | None = None
) -> TwoArms:
    """Returns the one part with the laws of all blocks; arguments as for `TwoArms`."""
    loops = [arm.loop(k) for k, arm in enumerate(arms, 1)]
    return TwoArms(held.held_object(), loops, wrists)


def _models(
    plant: MultibodyPlant,
    model_instances: Sequence[ModelInstanceIndex],
    frames: Sequence[Frame],
    loads: Sequence[ModelInstanceIndex],
    gravity: str,
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
        ControlModel.of_arm(plant, instance, E, without=loads, gravity=gravity == "controller")
        for instance, E in zip(model_instances, frames, strict=True)
    ]


def _of_blocks(
    held: ObjectParts, arms: Sequence[InnerLoopParts], wrists: WristSensors | None
) -> System:
    builder = DiagramBuilder()
    loops = [
        builder.AddNamedSystem(f"arm_{k}", make_inner_loop(arm)) for k, arm in enumerate(arms, 1)
    ]
    ports = add_object_loop(builder, held)
    wrenches, references = {}, {}
    for k, loop in enumerate(loops, 1):
        builder.ExportInput(loop.GetInputPort("estimated_state"), f"estimated_state_{k}")
        # O and its wrench are those of the hands; the grasp starts as they are.
        for target in ports.inputs[f"measured_motion_{k}"]:
            builder.Connect(loop.GetOutputPort("measured_motion"), target)
        # The inner loops track the references in place of D.
        reference = ports.outputs[f"reference_motion_{k}"]
        builder.Connect(reference, loop.GetInputPort("reference_motion"))
        references[f"reference_motion_{k}"] = reference
        # The wrench of a hand goes to the object, and to its arm for (2.3).
        wrenches[f"wrench_{k}"] = [*ports.inputs[f"wrench_{k}"], loop.GetInputPort("wrench")]
    for name in ("desired_motion", "stiffness_scale"):
        builder.ExportInput(*ports.inputs[name], name)
    for name, output in ports.outputs.items():
        builder.ExportOutput(output, name)
    if wrists is None:
        for name, reference in references.items():
            builder.ExportOutput(_last(builder, reference, name), f"last_{name}")
    for k, loop in enumerate(loops, 1):
        reports = ["actuation", "measured_motion", "peak_effort"]
        if arms[k - 1].limits.is_on:
            reports.append("limited")
            builder.Connect(loop.GetOutputPort("slack"), ports.slacks[k - 1])
        if arms[k - 1].remedies is not None:
            reports.append("compensation")
        for name in reports:
            builder.ExportOutput(loop.GetOutputPort(name), f"{name}_{k}")
    connect_wrenches(builder, wrists, wrenches, references)
    return builder.Build()


def _last(builder: DiagramBuilder, reference: OutputPort, name: str) -> OutputPort:
    """Returns what a reference was when the last step began, for sensors beside the controller."""
    system = builder.AddNamedSystem(f"last_{name}", LastMotion())
    builder.Connect(reference, system.GetInputPort("motion"))
    return system.GetOutputPort("last_motion")
