"""The object's part of tight cooperation, from hands to their references: its parts and blocks."""

from dataclasses import dataclass

from pydrake.systems.framework import DiagramBuilder, InputPort, OutputPort, System

from geoimp_drake.controllers.cooperative_config import CooperativeControllerConfig
from geoimp_drake.parts.grasp import GraspPose, HandReferences
from geoimp_drake.parts.grasp_watch import GraspWatch
from geoimp_drake.parts.held_object import HeldObject
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.object_kinematics import ObjectKinematics
from geoimp_drake.parts.object_load import LoadArguments
from geoimp_drake.parts.reference_hold import Hold
from geoimp_drake.systems.cooperation.cooperative_kinematics import CooperativeKinematics
from geoimp_drake.systems.cooperation.cooperative_reference_generator import (
    CooperativeReferenceGenerator,
)
from geoimp_drake.systems.cooperation.grasp_monitor import GraspMonitor
from geoimp_drake.systems.cooperation.internal_impedance import InternalImpedance
from geoimp_drake.systems.cooperation.reference_hold import ReferenceHold
from geoimp_drake.systems.impedance_integrator import ImpedanceIntegrator
from geoimp_drake.typing import Array

__all__ = ["ObjectLoopPorts", "ObjectParts", "add_object_loop"]


@dataclass(frozen=True)
class ObjectParts:
    """The parts of the blocks between the hands and their references."""

    impedance: Impedance
    internal: Impedance | None  # None for a constant mutual pose
    grasp: GraspPose
    load: LoadArguments
    watch: tuple[GraspWatch, Hold] | None  # None for neither

    @staticmethod
    def of(
        config: CooperativeControllerConfig, gravity: Array, internal: Impedance | None
    ) -> "ObjectParts":
        """Returns the parts.

        Args:
            config: of the whole controller.
            gravity: g in W (3) [m/s²].
            internal: the internal impedance, see `internal_gains.make_internal`.
        """
        period, watch = config.sampling.period, None
        if config.monitor.enabled:
            watch = GraspWatch(config.monitor, period), Hold(config.opened, period)
        return ObjectParts(
            config.impedance.make(),
            internal,
            GraspPose(config.mutual_pose),
            LoadArguments(config.load, gravity, config.wrench),
            watch,
        )

    def held_object(self) -> HeldObject:
        """Returns the one part with the laws of all blocks."""
        return HeldObject(self.impedance, self.internal, self.grasp, self.load, self.watch)


@dataclass(frozen=True)
class ObjectLoopPorts:
    """The ports of the blocks between hands and their references; an input may have several.

    The inputs `slacks`, for what the limits of both arms leave undone, may stay unconnected.
    """

    inputs: dict[str, list[InputPort]]
    outputs: dict[str, OutputPort]
    slacks: list[InputPort]


def add_object_loop(builder: DiagramBuilder, parts: ObjectParts) -> ObjectLoopPorts:
    """Adds the blocks between hands and their references, connected with each other.

    ```
    desired_motion ─────────────────▶ impedance ──C──▶ references ─▶ hold ─▶ reference_motion_1, _2
                         object ▲ wrench ▲ motion       ▲ mutual      ▲ opened
    wrench_1, _2 ──────▶ kinematics ─────┘     internal_impedance  grasp_monitor ◀─ wrench_1, _2
    measured_motion_1, _2 ─▶ ▲    └─ internal wrench ──▶┘
    ```

    Without a watch there are no outputs `opened` and `release`.

    Args:
        builder: where they are added.
        parts: what they are made of.
    """
    kinematics = builder.AddNamedSystem(
        "kinematics", CooperativeKinematics.of(ObjectKinematics(parts.load))
    )
    impedance = builder.AddNamedSystem("impedance", ImpedanceIntegrator.of(parts.impedance))
    references = builder.AddNamedSystem(
        "references", CooperativeReferenceGenerator.of(HandReferences(parts.grasp))
    )

    def connect(source: System, output: str, target: System, port: str) -> None:
        builder.Connect(source.GetOutputPort(output), target.GetInputPort(port))

    connect(references, "mutual_reference", kinematics, "mutual_reference")
    # The impedance is the single arm's, with O in place of E.
    connect(kinematics, "object_motion", impedance, "measured_motion")
    connect(kinematics, "object_wrench", impedance, "wrench")
    connect(kinematics, "object_slack", impedance, "slack")
    connect(impedance, "compliant_motion", references, "compliant_motion")
    if parts.load.removes_inertial_load:
        # The sensors read the wrench of the plant's last step, so the load is that of C then. This
        # also breaks the loop acceleration of C → wrench → acceleration of C.
        connect(impedance, "last_compliant_motion", kinematics, "reference_motion")
    if parts.internal is not None:
        # The internal wrench moves the mutual pose of the references.
        internal = builder.AddNamedSystem(
            "internal_impedance", InternalImpedance.of(parts.internal)
        )
        connect(references, "mutual_reference", internal, "desired_motion")
        connect(kinematics, "mutual_wrench", internal, "wrench")
        connect(kinematics, "mutual_motion", internal, "measured_motion")
        connect(internal, "compliant_motion", references, "mutual_motion")
        connect(kinematics, "mutual_slack", internal, "slack")
    inputs = {
        name: [impedance.GetInputPort(name)] for name in ("desired_motion", "stiffness_scale")
    }
    outputs = _outputs(impedance, "compliant_motion", "displacement", "energy")
    outputs |= _outputs(
        kinematics, "object_motion", "object_wrench", "internal_wrench", "mutual_motion"
    )
    outputs |= _outputs(references, "mutual_reference", "reference_motion_1", "reference_motion_2")
    for k in (1, 2):
        inputs[f"wrench_{k}"] = [kinematics.GetInputPort(f"wrench_{k}")]
        inputs[f"measured_motion_{k}"] = [
            kinematics.GetInputPort(f"motion_{k}"),
            references.GetInputPort(f"measured_motion_{k}"),
        ]
    slacks = [kinematics.GetInputPort(f"slack_{k}") for k in (1, 2)]
    ports = ObjectLoopPorts(inputs, outputs, slacks)
    if parts.watch is not None:
        _add_watch(builder, *parts.watch, ports)
    return ports


def _outputs(system: System, *names: str) -> dict[str, OutputPort]:
    return {name: system.GetOutputPort(name) for name in names}


def _add_watch(
    builder: DiagramBuilder, watch: GraspWatch, hold: Hold, ports: ObjectLoopPorts
) -> None:
    """Adds what watches the grasps and holds the hands, between references and arms."""
    monitor = builder.AddNamedSystem("grasp_monitor", GraspMonitor.of(watch))
    resting = builder.AddNamedSystem("hold", ReferenceHold.of(hold))
    for k in (1, 2):
        ports.inputs[f"wrench_{k}"].append(monitor.GetInputPort(f"wrench_{k}"))
        name = f"reference_motion_{k}"
        builder.Connect(ports.outputs[name], resting.GetInputPort(name))
        ports.outputs[name] = resting.GetOutputPort(f"held_motion_{k}")
    builder.Connect(monitor.GetOutputPort("opened"), resting.GetInputPort("opened"))
    ports.outputs["opened"] = monitor.GetOutputPort("opened")
    ports.outputs["release"] = resting.GetOutputPort("release")
