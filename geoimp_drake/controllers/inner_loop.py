"""The inner loop of one arm, from a reference motion to torques: five blocks, or one system."""

from pydrake.systems.framework import DiagramBuilder, System

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.compilation.compiled import is_available
from geoimp_drake.controllers.config import MotionConfig, RedundancyConfig, SamplingConfig
from geoimp_drake.systems.arm.arm_control import ArmControl
from geoimp_drake.systems.arm.arm_loop import ArmBlocks
from geoimp_drake.systems.arm.arm_model import ArmModel
from geoimp_drake.systems.arm.inverse_dynamics_inner_loop import InverseDynamicsInnerLoop
from geoimp_drake.task_functions.task_function import TaskFunction

__all__ = ["arm_blocks", "arm_can_be_fused", "make_inner_loop"]


def make_inner_loop(
    model: ControlModel,
    motion_config: MotionConfig,
    sampling_config: SamplingConfig,
    redundancy_config: RedundancyConfig,
    task_function: TaskFunction | None = None,
    *,
    fused: bool = True,
) -> System:
    """Returns the inner loop of one arm: an `ArmControl`, or a Diagram with the same ports.

    ```
    reference_motion ─▶ motion_control ─▶ redundancy ─▶ inverse_dynamics ─▶ actuation
                            ▲                 ▲            ▲      ▲
    estimated_state ─▶ joint_readings ─▶ arm_model ────────┘    wrench
    ```

    Args:
        model: the arm.
        motion_config: of `motion_control`.
        sampling_config: of `joint_readings`.
        redundancy_config: of `redundancy`.
        task_function: in the place of the configured one.
        fused: one system, if laws can be compiled (without numba they cannot) and the orientation
            law is (2.15); else the blocks are separate.
    """
    blocks = arm_blocks(model, motion_config, sampling_config, redundancy_config, task_function)
    if fused and arm_can_be_fused(motion_config):
        return ArmControl(blocks)
    return _separate(blocks)


def arm_blocks(
    model: ControlModel,
    motion_config: MotionConfig,
    sampling_config: SamplingConfig,
    redundancy_config: RedundancyConfig,
    task_function: TaskFunction | None = None,
) -> ArmBlocks:
    """Returns the blocks of the loop but for those without a choice; see `make_inner_loop`."""
    return ArmBlocks(
        model,
        sampling_config.make(model.num_joints),
        motion_config.make(),
        redundancy_config.make(model, task_function),
    )


def arm_can_be_fused(motion_config: MotionConfig) -> bool:
    """Whether the inner loop can be one system: laws are compiled, the orientation law is (2.15).

    Args:
        motion_config: of the loop.
    """
    return is_available() and motion_config.orientation == "quaternion"


def _separate(blocks: ArmBlocks) -> System:
    model, readings = blocks.model, blocks.readings
    motion, redundancy = blocks.motion, blocks.redundancy
    builder = DiagramBuilder()
    builder.AddNamedSystem("joint_readings", readings)
    arm = builder.AddNamedSystem("arm_model", ArmModel(model))
    builder.AddNamedSystem("motion_control", motion)
    builder.AddNamedSystem("redundancy", redundancy)
    torque = builder.AddNamedSystem(
        "inverse_dynamics", InverseDynamicsInnerLoop(model, readings.period)
    )
    for system in (motion, redundancy, torque):
        builder.Connect(arm.GetOutputPort("arm"), system.GetInputPort("arm"))
    for source, output, target, port in (
        (readings, "estimated_state", arm, "state"),
        (motion, "task_acceleration", redundancy, "task_acceleration"),
        (redundancy, "joint_acceleration", torque, "joint_acceleration"),
    ):
        builder.Connect(source.GetOutputPort(output), target.GetInputPort(port))
    builder.ExportInput(readings.GetInputPort("state"), "estimated_state")
    builder.ExportInput(motion.GetInputPort("reference_motion"), "reference_motion")
    builder.ExportInput(torque.GetInputPort("wrench"), "wrench")
    builder.ExportOutput(torque.GetOutputPort("actuation"), "actuation")
    builder.ExportOutput(arm.GetOutputPort("motion_E"), "measured_motion")
    builder.ExportOutput(torque.GetOutputPort("peak_effort"), "peak_effort")
    for port in ("smallest_singular_value", "null_space_error", "task_value"):
        builder.ExportOutput(redundancy.GetOutputPort(port), port)
    return builder.Build()
