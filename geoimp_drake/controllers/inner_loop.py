"""The inner loop of one arm, from a reference motion to torques: its parts, and its blocks."""

from dataclasses import dataclass

from pydrake.systems.framework import Diagram, DiagramBuilder, InputPort, OutputPort

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.config import MotionConfig, RedundancyConfig, SamplingConfig
from geoimp_drake.parts.inner_loop import InnerLoop
from geoimp_drake.parts.joint_limits import JointLimits, LimitsConfig
from geoimp_drake.parts.joint_readings import Readings
from geoimp_drake.parts.masses import Masses
from geoimp_drake.parts.motion_control import MotionControl
from geoimp_drake.parts.null_space import NullSpace
from geoimp_drake.parts.remedies import Remedies
from geoimp_drake.parts.remedies_config import RemediesConfig
from geoimp_drake.systems.arm.arm_model import ArmModel
from geoimp_drake.systems.arm.constrained_acceleration import ConstrainedAcceleration
from geoimp_drake.systems.arm.inverse_dynamics_inner_loop import InverseDynamicsInnerLoop
from geoimp_drake.systems.arm.joint_readings import JointReadings
from geoimp_drake.systems.arm.motion_controller import MotionController
from geoimp_drake.systems.arm.redundancy_resolver import RedundancyResolver
from geoimp_drake.systems.arm.remedies import Remedies as RemediesBlock
from geoimp_drake.task_functions.task_function import TaskFunction

__all__ = ["InnerLoopParts", "InnerLoopPorts", "add_inner_loop", "make_inner_loop"]


@dataclass(frozen=True)
class InnerLoopParts:
    """The parts of an inner loop's blocks; `loop` makes the one part with the same laws."""

    model: ControlModel
    readings: Readings
    motion: MotionControl
    null_space: NullSpace
    limits: JointLimits
    remedies: Remedies | None = None

    @staticmethod
    def of(
        model: ControlModel,
        motion: MotionConfig,
        sampling: SamplingConfig,
        redundancy: RedundancyConfig,
        limits: LimitsConfig | None = None,
        masses: Masses | None = None,
        task_function: TaskFunction | None = None,
        remedies: RemediesConfig | None = None,
    ) -> "InnerLoopParts":
        """Returns the parts.

        Args:
            model: the arm.
            motion: of the motion loop.
            sampling: of the readings.
            redundancy: of the null-space motion, and of the damping near singularities.
            limits: how the joints' limits are kept; None for not at all.
            masses: of the impedance; unit matrices by default.
            task_function: in place of the configured one.
            remedies: against errors of the model; None for none.

        Raises:
            ConfigurationError: a configuration cannot be used for the arm.
        """
        null_space = redundancy.make(model, task_function, sampling.period)
        kept = JointLimits(model, limits, masses, redundancy.damping)
        tracking, added = motion.make(), None
        if remedies is not None and remedies.is_on:
            added = Remedies(model, remedies, tracking, sampling.period, redundancy.damping)
        return InnerLoopParts(model, sampling.make(model), tracking, null_space, kept, added)

    def loop(self, arm: int = 0) -> InnerLoop:
        """Returns the one part; `arm` is the number of the arm from one on, zero if it is alone."""
        parts = self.model, self.readings, self.motion, self.null_space, self.limits
        return InnerLoop(*parts, arm, self.remedies)


@dataclass(frozen=True)
class InnerLoopPorts:
    """The ports of an inner loop's blocks."""

    inputs: dict[str, list[InputPort]]
    outputs: dict[str, OutputPort]
    arm: OutputPort  # ArmState


def add_inner_loop(builder: DiagramBuilder, parts: InnerLoopParts) -> InnerLoopPorts:
    """Adds the blocks of an inner loop, connected with each other.

    ```
    reference_motion ─▶ motion_control ─▶ redundancy ─▶ limits ─▶ inverse_dynamics ─▶ actuation
                            ▲                 ▲           ▲  ▲       ▲      ▲
    estimated_state ─▶ joint_readings ─▶ arm_model ───────┴──│───────┘      │
    wrench ──────────────────────────────────────────────────┴──────────────┘
    ```

    Without limits there is no block of that name. With remedies a block of that name adds to the
    torques, from readings, reference motion and wrench.

    Args:
        builder: where they are added.
        parts: what they are made of.
    """
    model = parts.model
    readings = builder.AddNamedSystem("joint_readings", JointReadings.of(parts.readings))
    arm = builder.AddNamedSystem("arm_model", ArmModel(model))
    motion = builder.AddNamedSystem("motion_control", MotionController.of(parts.motion))
    resolver = RedundancyResolver.part_of(model, parts.null_space, parts.limits.threshold)
    redundancy = builder.AddNamedSystem("redundancy", RedundancyResolver.of(resolver))
    torque = builder.AddNamedSystem("inverse_dynamics", InverseDynamicsInnerLoop(model))
    for system in (motion, redundancy, torque):
        builder.Connect(arm.GetOutputPort("arm"), system.GetInputPort("arm"))
    a, alpha = motion.GetOutputPort("task_acceleration"), "joint_acceleration"
    builder.Connect(readings.GetOutputPort("estimated_state"), arm.GetInputPort("state"))
    builder.Connect(a, redundancy.GetInputPort("task_acceleration"))
    last, wrenches, limited = redundancy, [torque.GetInputPort("wrench")], {}
    if parts.limits.is_on:
        last = limits = builder.AddNamedSystem(
            "limits", ConstrainedAcceleration.of(ConstrainedAcceleration.part_of(parts.limits))
        )
        builder.Connect(arm.GetOutputPort("arm"), limits.GetInputPort("arm"))
        builder.Connect(a, limits.GetInputPort("task_acceleration"))
        builder.Connect(redundancy.GetOutputPort(alpha), limits.GetInputPort(alpha))
        wrenches.append(limits.GetInputPort("wrench"))
        limited = {name: limits.GetOutputPort(name) for name in ("limited", "slack")}
    builder.Connect(last.GetOutputPort(alpha), torque.GetInputPort(alpha))
    references, reported, added = [motion.GetInputPort("reference_motion")], torque, {}
    if parts.remedies is not None:
        reported = remedies = builder.AddNamedSystem("remedies", RemediesBlock.of(parts.remedies))
        builder.Connect(torque.GetOutputPort("actuation"), remedies.GetInputPort("torque"))
        state = "estimated_state"
        builder.Connect(readings.GetOutputPort(state), remedies.GetInputPort(state))
        references.append(remedies.GetInputPort("reference_motion"))
        wrenches.append(remedies.GetInputPort("wrench"))
        added = {"compensation": remedies.GetOutputPort("compensation")}
    reports = ("smallest_singular_value", "null_space_error", "task_value")
    return InnerLoopPorts(
        {
            "estimated_state": [readings.GetInputPort("state")],
            "reference_motion": references,
            "wrench": wrenches,
        },
        {
            "actuation": reported.GetOutputPort("actuation"),
            "measured_motion": arm.GetOutputPort("motion_E"),
            "peak_effort": reported.GetOutputPort("peak_effort"),
            **{name: redundancy.GetOutputPort(name) for name in reports},
            **limited,
            **added,
        },
        arm.GetOutputPort("arm"),
    )


def make_inner_loop(parts: InnerLoopParts) -> Diagram:
    """Returns the blocks of an inner loop as a Diagram; see `add_inner_loop`."""
    builder = DiagramBuilder()
    ports = add_inner_loop(builder, parts)
    for name, inputs in ports.inputs.items():
        builder.ExportInput(inputs[0], name)
        for port in inputs[1:]:
            builder.ConnectInput(name, port)
    for name, output in ports.outputs.items():
        builder.ExportOutput(output, name)
    return builder.Build()
