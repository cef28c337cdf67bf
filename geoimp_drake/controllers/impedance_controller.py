"""The impedance controller of one arm of any plant: a Diagram of blocks, or one system."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex
from pydrake.systems.framework import DiagramBuilder, System
from pydrake.systems.primitives import ConstantVectorSource

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.admittance_controller import make_admittance_controller
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.forms import add_passivity, connect_wrenches, make_compiled
from geoimp_drake.controllers.inner_loop import InnerLoopParts, add_inner_loop
from geoimp_drake.controllers.sensor_checks import check_sensor
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.direct_impedance import DirectImpedance
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.impedance_controller import EndEffectorImpedance, ImpedanceController
from geoimp_drake.parts.passivity import Passivity
from geoimp_drake.parts.wrist_sensor_config import WristSensor
from geoimp_drake.parts.wrist_sensors import WristSensors
from geoimp_drake.systems import direct_impedance
from geoimp_drake.systems.impedance_integrator import ImpedanceIntegrator
from geoimp_drake.systems.naming import name_after_arms
from geoimp_drake.systems.natural_impedance import NaturalImpedance
from geoimp_drake.systems.part_system import PartSystem
from geoimp_drake.task_functions.task_function import TaskFunction
from geoimp_drake.validation import check, choice

__all__ = ["GRAVITY", "controller_parts", "impedance_block", "make_impedance_controller"]

# Who holds the arm's weight.
GRAVITY = ("controller", "robot")


def make_impedance_controller(
    plant: MultibodyPlant,
    model_instance: ModelInstanceIndex,
    end_effector_frame: Frame,
    config: ImpedanceControllerConfig | None = None,
    task_function: TaskFunction | None = None,
    *,
    sensor: WristSensor | None = None,
    gravity: str = "controller",
) -> System:
    """Makes a six-DOF impedance controller for one arm of `plant`.

    The end effector behaves as a mass, damper and spring about the desired motion: by (3.1) and
    (3.30), or the orientation family of the configuration.

    ```
    desired_motion ─▶ impedance ─▶ motion_control ─▶ redundancy ─▶ inverse_dynamics ─▶ actuation
                       ▲  ▲   C          ▲      a        ▲     α       ▲  ▲
    wrench ────────────┴──│──────────────│───────────────│─────────────┘  │
                          └──────────────┴────┬──────────┴────────────────┘
    estimated_state ─▶ joint_readings ─▶ arm_model
    ```

    Between redundancy and inverse dynamics `limits` keeps the joints within their limits, unless
    `config.limits` is null; what it leaves undone holds C back.

    With `config.form` "blocks" it is a Diagram of these systems, each of which you may inspect, log
    or replace. With "compiled" it is one system with the same ports and numbers, which takes less
    time: see `geoimp_drake.parts.impedance_controller`.

    With `config.scheme` "direct" the block `impedance` has no state. C is E as measured, with the
    acceleration that makes the impedance the closed loop of E. Then `motion_control` finds no error
    and passes that acceleration on; see `systems.direct_impedance.DirectImpedance`.

    With `config.scheme` "admittance" the arm's own servos replace the inner loop, and
    `inverse_kinematics` makes their references every `config.sampling.period`:

    ```
    desired_motion, wrench ─▶ impedance ─C─▶ inverse_kinematics ─▶ joint_reference ─▶ servos
    ```

    Then `joint_reference`, [q_d; q̇_d] in the plant's order (2n), and `reference_error` (6) replace
    the outputs of the inner loop. `measured_motion` and the outputs of the impedance are the same.
    `motion` and `gravity` have no effect.

    The controller makes its own model of the arm and of all that is welded to it. Joints of other
    model instances on the arm (a gripper's fingers) count as locked in their default positions. The
    plant's own friction model is viscous. Forces from elements other than gravity and joint damping
    are not compensated.

    Args:
        plant: finalized, contains the arm at any base pose; whatever else it contains is ignored.
        model_instance: the arm, six or more revolute or prismatic joints, each with an actuator.
        end_effector_frame: E, the frame that is made compliant.
        config: gains, orientation family and sampling; by default the chapter's first experiment.
        task_function: of a redundant arm, in place of the configured one; also your own.
        sensor: of the wrist, from `wrist_sensor_at` on the real plant. With it the controller reads
            the plant's reaction forces itself; connect it by `connect_wrist_sensors`.
        gravity: who holds the arm's weight, `controller`, or `robot` behind a driver that does.

    Returns:
        A system with these ports, named ARM_impedance_controller; a second one for the same arm
        gets a number.

        input estimated_state: [q; v] of the model instance, in the plant's order (2n)
        input desired_motion: of D in W, see `frame_motion` (19)
        input wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6)
        input stiffness_scale: factors of K_p and K_o, one each if not connected (2)
        output actuation: torques in the order of the model instance's actuators (n) [Nm or N]
        output compliant_motion: of C in W (19)
        output measured_motion: of E in W from the joint readings; accelerations are zero (19)
        output displacement: of D from C: [orientation displacement; Δp_dc] (6)
        output energy: energies and powers of the impedance, `ImpedanceEnergy` (9)
        output peak_effort: largest torque so far as a fraction of the limit (n)
        output last_compliant_motion: of C when the last step began; a held state (19)
        output smallest_singular_value: of the Jacobian of E, in rad and m (1)
        output null_space_error: e_n of (3.37), zero for six joints (n)
        output task_value: the task function w (1)
        output limited: effect of limits since the last step began, `Limited`; not with null (10)

        With `config.passivity.gains` there are inputs `stiffness` and `damping` (36), K and D (6×6)
        row by row in the order [angular; linear]. Where they are not connected, K and D are as
        configured. An output `tank` has the energy that is available for their changes: see
        `systems.passive_gains`. With `config.passivity.damping` there are outputs `damping_scale`,
        `given_out` and `alternating` of `systems.adaptive_damping`.

        With `config.remedies` there is an output `compensation`: the torques that they add, which
        `actuation` contains; see `systems.arm.remedies`.

        With a sensor, inputs for the plant's outputs (`reaction_forces`, `state` and what else it
        reads) replace `wrench`. Then there are outputs `wrench`, `wrench_true` and `peak_reading`
        as `ForceTorqueSensor` has them.

    Raises:
        ModelError: the plant does not contain such an arm.
        ConfigurationError: the configuration cannot be used.
    """
    config = config or ImpedanceControllerConfig()
    if config.scheme == "admittance":
        check(config)
        choice(gravity, "gravity", GRAVITY)
        _refuse_task(task_function)
        model = ControlModel.of_arm(plant, model_instance, end_effector_frame)
        sensors = _sensors(sensor, end_effector_frame, config)
        controller = make_admittance_controller(model, config, sensors)
    else:
        impedance, arm = controller_parts(
            plant, model_instance, end_effector_frame, config, task_function, gravity=gravity
        )
        sensors = _sensors(sensor, end_effector_frame, config)
        passivity = config.make_passivity(impedance)
        if config.form == "compiled":
            part = ImpedanceController(impedance, arm.loop(), sensors, passivity)
            controller = make_compiled(part)
        else:
            controller = _of_blocks(impedance, arm, sensors, passivity)
    controller.set_name(name_after_arms(plant, [model_instance], "impedance_controller"))
    return controller


def _sensors(
    sensor: WristSensor | None, E: Frame, config: ImpedanceControllerConfig
) -> WristSensors | None:
    if sensor is None:
        return None
    check_sensor(sensor, E, config.impedance, config.motion, config.sampling, scheme=config)
    config.check_inertial_load(sensor.config.inertial_load)
    return WristSensors([sensor], reference_is_held=True, suffixes=[""], all_of_them=False)


def _refuse_task(task: TaskFunction | None) -> None:
    if task is not None:
        raise ConfigurationError(
            "scheme 'admittance' takes no task function: a redundant arm goes back to the posture "
            "at the start, at the rate reference.posture_gain. Leave task_function out."
        )


def controller_parts(
    plant: MultibodyPlant,
    model_instance: ModelInstanceIndex,
    end_effector_frame: Frame,
    config: ImpedanceControllerConfig,
    task_function: TaskFunction | None,
    *,
    gravity: str = "controller",
) -> tuple[EndEffectorImpedance, InnerLoopParts]:
    """Returns the parts of the blocks; arguments and errors are those of the controller.

    Args:
        plant: this and the following five are those of `make_impedance_controller`.
        model_instance: see there.
        end_effector_frame: see there.
        config: see there.
        task_function: see there.
        gravity: see there.
    """
    check(config)
    if config.scheme == "admittance":
        raise ConfigurationError(
            "scheme 'admittance' makes no torques: use make_impedance_controller, or "
            "AdmittanceLoop, which returns joint positions and velocities."
        )
    choice(gravity, "gravity", GRAVITY)
    has_weight = gravity == "controller"
    model = ControlModel.of_arm(plant, model_instance, end_effector_frame, gravity=has_weight)
    impedance = config.make_impedance(config.impedance)
    return impedance, InnerLoopParts.of(
        model,
        config.motion,
        config.sampling,
        config.redundancy,
        config.limits,
        config.impedance.masses(),
        task_function,
        config.remedies,
    )


def impedance_block(impedance: EndEffectorImpedance) -> PartSystem:
    """Returns the part that moves C as a block."""
    if isinstance(impedance, Impedance):
        return ImpedanceIntegrator.of(impedance)
    if isinstance(impedance, DirectImpedance):
        return direct_impedance.DirectImpedance.of(impedance)
    return NaturalImpedance.of(impedance)


def _of_blocks(
    impedance: EndEffectorImpedance,
    arm: InnerLoopParts,
    sensors: WristSensors | None,
    passivity: Passivity,
) -> System:
    builder = DiagramBuilder()
    compliant = builder.AddNamedSystem("impedance", impedance_block(impedance))
    loop = add_inner_loop(builder, arm)
    # C starts on the measured pose of E, or is E.
    if impedance.needs_wrench:
        measured = loop.outputs["measured_motion"]
        builder.Connect(measured, compliant.GetInputPort("measured_motion"))
    else:
        builder.Connect(loop.arm, compliant.GetInputPort("arm"))
    # The inner loop tracks C in place of D.
    for target in loop.inputs["reference_motion"]:
        builder.Connect(compliant.GetOutputPort("compliant_motion"), target)
    builder.ExportInput(*loop.inputs["estimated_state"], "estimated_state")
    builder.ExportInput(compliant.GetInputPort("desired_motion"), "desired_motion")
    wrenches = [compliant.GetInputPort("wrench")]
    if impedance.needs_wrench:
        # The same wrench is compensated in (2.3).
        wrenches += loop.inputs["wrench"]
    else:
        none = builder.AddNamedSystem("no_wrench", ConstantVectorSource(np.zeros(6)))
        for target in loop.inputs["wrench"]:
            builder.Connect(none.get_output_port(), target)
    add_passivity(builder, compliant, passivity, loop.outputs["measured_motion"], wrenches)
    slack = loop.outputs.pop("slack", None)
    if slack is not None:
        # C is held back by what the limits leave undone.
        builder.Connect(slack, compliant.GetInputPort("slack"))
    for name in ("compliant_motion", "displacement", "energy", "last_compliant_motion"):
        builder.ExportOutput(compliant.GetOutputPort(name), name)
    for name, port in loop.outputs.items():
        builder.ExportOutput(port, name)
    reference = compliant.GetOutputPort("last_compliant_motion")
    connect_wrenches(builder, sensors, {"wrench": wrenches}, {"reference_motion": reference})
    return builder.Build()
