"""The object's part of tight cooperation, from hands to their references: blocks, or one system."""

from collections.abc import Sequence

from pydrake.systems.framework import DiagramBuilder, OutputPort, System

from geoimp_drake.compilation.compiled import is_available
from geoimp_drake.controllers.cooperative_config import CooperativeControllerConfig
from geoimp_drake.systems.cooperation.cooperative_kinematics import (
    CooperativeKinematics,
    ObjectLoad,
)
from geoimp_drake.systems.cooperation.cooperative_reference_generator import (
    CooperativeReferenceGenerator,
)
from geoimp_drake.systems.cooperation.grasp_monitor import GraspMonitor
from geoimp_drake.systems.cooperation.object_control import ObjectControl
from geoimp_drake.systems.cooperation.object_control_base import ObjectBlocks
from geoimp_drake.systems.cooperation.reference_hold import ReferenceHold
from geoimp_drake.systems.last_motion import LastMotion
from geoimp_drake.typing import Array

__all__ = [
    "OBJECT_PORTS",
    "REFERENCE_PORTS",
    "WATCH_PORTS",
    "make_object_loop",
    "object_blocks",
    "object_can_be_fused",
]

# Outputs besides the references.
OBJECT_PORTS = (
    "compliant_motion",
    "displacement",
    "energy",
    "object_motion",
    "object_wrench",
    "internal_wrench",
    "mutual_motion",
    "mutual_reference",
)
REFERENCE_PORTS = (
    "reference_motion_1",
    "reference_motion_2",
    "last_reference_motion_1",
    "last_reference_motion_2",
)
# And those of the watch over the grasps, if there is one.
WATCH_PORTS = ("opened", "release")


def make_object_loop(config: CooperativeControllerConfig, gravity: Array) -> System:
    """Returns the object's part: an `ObjectControl`, or a Diagram with the same ports.

    ```
    desired_motion ─────────────────▶ impedance ──C──▶ references ─▶ hold ─▶ reference_motion_1, _2
                         object ▲ wrench ▲ motion       ▲ mutual      ▲ opened
    wrench_1, _2 ──────▶ kinematics ─────┘     internal_impedance  grasp_monitor ◀─ wrench_1, _2
    measured_motion_1, _2 ─▶ ▲    └─ internal wrench ──▶┘
    ```

    With the monitor switched off there are no outputs `opened` and `release`.

    Args:
        config: of the whole controller. With the form `compiled` it is one system, if laws can be
            compiled (without numba they cannot) and the orientation family is the quaternion.
        gravity: g in W (3) [m/s²].
    """
    blocks = object_blocks(config, gravity)
    if config.form == "compiled" and object_can_be_fused(config):
        return ObjectControl(blocks)
    return _separate(blocks)


def object_can_be_fused(config: CooperativeControllerConfig) -> bool:
    """Whether the object's part can be one system: laws are compiled, the family is (3.30)'s.

    Args:
        config: of the whole controller.
    """
    return is_available() and config.impedance.orientation == "quaternion"


def object_blocks(config: CooperativeControllerConfig, gravity: Array) -> ObjectBlocks:
    """Returns the blocks; arguments are those of `make_object_loop`."""
    period, load = config.sampling.period, config.load or ObjectLoad()
    internal = config.internal.make("internal", period) if config.internal.enabled else None
    watch = None
    if config.monitor.enabled:
        watch = config.monitor.make(period), ReferenceHold(config.opened, period)
    return ObjectBlocks(
        CooperativeKinematics(load, gravity, config.wrench),
        config.impedance.make(),
        CooperativeReferenceGenerator(config.mutual_pose),
        internal,
        watch,
        removes_inertial_load=load.mass > 0 and load.inertial_load == "compliant",
    )


def _separate(blocks: ObjectBlocks) -> System:
    kinematics, impedance, internal = blocks.kinematics, blocks.impedance, blocks.internal
    references, watch = blocks.references, blocks.watch
    builder = DiagramBuilder()
    builder.AddNamedSystem("kinematics", kinematics)
    builder.AddNamedSystem("impedance", impedance)
    builder.AddNamedSystem("references", references)

    def connect(source: System, output: str, target: System, port: str) -> None:
        builder.Connect(source.GetOutputPort(output), target.GetInputPort(port))

    connect(references, "mutual_reference", kinematics, "mutual_reference")
    # The impedance is the single arm's, with O in the place of E.
    connect(kinematics, "object_motion", impedance, "measured_motion")
    connect(kinematics, "object_wrench", impedance, "wrench")
    connect(impedance, "compliant_motion", references, "compliant_motion")
    if blocks.removes_inertial_load:
        # A reading of the sensors is of the plant's last step. That also breaks the loop
        # acceleration of C → wrench → acceleration of C.
        connect(impedance, "last_compliant_motion", kinematics, "reference_motion")
    if internal is not None:
        # The internal wrench moves the mutual pose of the references.
        builder.AddNamedSystem("internal_impedance", internal)
        connect(references, "mutual_reference", internal, "desired_motion")
        connect(kinematics, "mutual_wrench", internal, "wrench")
        connect(kinematics, "mutual_motion", internal, "measured_motion")
        connect(internal, "compliant_motion", references, "mutual_motion")
    for port in ("desired_motion", "stiffness_scale"):
        builder.ExportInput(impedance.GetInputPort(port), port)
    for k in (1, 2):
        builder.ExportInput(kinematics.GetInputPort(f"wrench_{k}"), f"wrench_{k}")
    for k in (1, 2):
        hand = builder.ExportInput(kinematics.GetInputPort(f"motion_{k}"), f"measured_motion_{k}")
        builder.ConnectInput(hand, references.GetInputPort(f"measured_motion_{k}"))
    for system, ports in ((impedance, OBJECT_PORTS[:3]), (kinematics, OBJECT_PORTS[3:7])):
        for port in ports:
            builder.ExportOutput(system.GetOutputPort(port), port)
    builder.ExportOutput(references.GetOutputPort("mutual_reference"), "mutual_reference")
    motions = [references.GetOutputPort(f"reference_motion_{k}") for k in (1, 2)]
    if watch is not None:
        motions = _add_watch(builder, *watch, motions)
    for k, motion in enumerate(motions, 1):
        builder.ExportOutput(motion, f"reference_motion_{k}")
    for k, motion in enumerate(motions, 1):
        last = builder.AddNamedSystem(f"last_reference_motion_{k}", LastMotion())
        builder.Connect(motion, last.GetInputPort("motion"))
        builder.ExportOutput(last.GetOutputPort("last_motion"), f"last_reference_motion_{k}")
    return builder.Build()


def _add_watch(
    builder: DiagramBuilder,
    monitor: GraspMonitor,
    hold: ReferenceHold,
    motions: Sequence[OutputPort],
) -> list[OutputPort]:
    """Adds what watches the grasps and holds the hands; returns the motions to be tracked."""
    builder.AddNamedSystem("grasp_monitor", monitor)
    builder.AddNamedSystem("hold", hold)
    for k, motion in enumerate(motions, 1):
        builder.ConnectInput(f"wrench_{k}", monitor.GetInputPort(f"wrench_{k}"))
        builder.Connect(motion, hold.GetInputPort(f"reference_motion_{k}"))
    builder.Connect(monitor.GetOutputPort("opened"), hold.GetInputPort("opened"))
    for system, port in zip((monitor, hold), WATCH_PORTS, strict=True):
        builder.ExportOutput(system.GetOutputPort(port), port)
    return [hold.GetOutputPort(f"held_motion_{k}") for k in (1, 2)]
