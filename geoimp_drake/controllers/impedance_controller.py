"""The blocks as one Diagram with a controller's ports, for anybody's plant."""

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex
from pydrake.systems.framework import Diagram, DiagramBuilder

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.inner_loop import make_inner_loop
from geoimp_drake.task_functions.task_function import TaskFunction
from geoimp_drake.validation import check

__all__ = ["make_impedance_controller"]

_OUTPUTS = (
    "actuation",
    "compliant_motion",
    "measured_motion",
    "displacement",
    "energy",
    "peak_effort",
    "last_compliant_motion",
    "smallest_singular_value",
    "null_space_error",
    "task_value",
)


def make_impedance_controller(
    plant: MultibodyPlant,
    model_instance: ModelInstanceIndex,
    end_effector_frame: Frame,
    config: ImpedanceControllerConfig | None = None,
    task_function: TaskFunction | None = None,
) -> Diagram:
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

    All but the impedance is one system, `ArmControl`, with the form `compiled`: the same laws
    with fewer calls into Python.

    The controller makes its own model of the arm and of all that is welded to it; the joints of
    other model instances that hang on the arm (a gripper's fingers) count as locked in their
    default positions. The plant's own friction model is viscous; forces from elements other than
    gravity and joint damping are not compensated.

    Args:
        plant: finalized, contains the arm at any base pose; whatever else it contains is ignored.
        model_instance: the arm, six or more revolute or prismatic joints, each with an actuator.
        end_effector_frame: E, the frame that is made compliant.
        config: gains, orientation family and sampling; by default the chapter's first experiment.
        task_function: of a redundant arm, in the place of the configured one; it acts with
            `config.redundancy.k_beta`. See `UserFunction` for your own.

    Returns:
        A Diagram with these ports.

        input estimated_state: [q; v] of the model instance, in the plant's order (2n)
        input desired_motion: of D in W, see `frame_motion` (19)
        input wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6)
        input stiffness_scale: factors of K_p and K_o, one each if not connected (2)
        output actuation: torques in the order of the model instance's actuators (n) [Nm or N]
        output compliant_motion: of C in W (19)
        output measured_motion: of E in W as the joint readings tell; accelerations are zero (19)
        output displacement: of D from C: [orientation displacement; Δp_dc] (6)
        output energy: energies and powers of the impedance, `ImpedanceEnergy` (9)
        output peak_effort: largest torque so far as a fraction of the limit (n)
        output last_compliant_motion: of C when the last step began; a held state (19)
        output smallest_singular_value: of the Jacobian of E, in rad and m (1)
        output null_space_error: e_n of (3.37), zero for six joints (n)
        output task_value: the task function w (1)

    Raises:
        ModelError: the plant does not contain such an arm.
        ConfigurationError: the configuration cannot be used.
    """
    config = config or ImpedanceControllerConfig()
    check(config)
    model = ControlModel.of_arm(plant, model_instance, end_effector_frame)

    builder = DiagramBuilder()
    impedance = builder.AddNamedSystem("impedance", config.impedance.make())
    arm = builder.AddNamedSystem(
        "arm",
        make_inner_loop(
            model,
            config.motion,
            config.sampling,
            config.redundancy,
            task_function,
            fused=config.form == "compiled",
        ),
    )
    # C starts on the measured pose of E.
    builder.Connect(arm.GetOutputPort("measured_motion"), impedance.GetInputPort("measured_motion"))
    # The inner loop tracks C in the place of D.
    builder.Connect(
        impedance.GetOutputPort("compliant_motion"), arm.GetInputPort("reference_motion")
    )
    builder.ExportInput(arm.GetInputPort("estimated_state"), "estimated_state")
    builder.ExportInput(impedance.GetInputPort("desired_motion"), "desired_motion")
    wrench = builder.ExportInput(impedance.GetInputPort("wrench"), "wrench")
    # The same wrench is compensated in (2.3).
    builder.ConnectInput(wrench, arm.GetInputPort("wrench"))
    builder.ExportInput(impedance.GetInputPort("stiffness_scale"), "stiffness_scale")
    for port in _OUTPUTS:
        system = impedance if impedance.HasOutputPort(port) else arm
        builder.ExportOutput(system.GetOutputPort(port), port)
    diagram = builder.Build()
    diagram.set_name(f"{plant.GetModelInstanceName(model_instance)}_impedance_controller")
    return diagram
