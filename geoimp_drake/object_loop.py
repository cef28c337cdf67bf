"""The object's part of tight cooperation, from hands to their references: blocks, or one system."""

from collections.abc import Sequence

from pydrake.systems.framework import DiagramBuilder, OutputPort, System

from geoimp_drake.compiled import is_available
from geoimp_drake.cooperative_config import CooperativeControllerConfig
from geoimp_drake.systems.cooperative_kinematics import CooperativeKinematics
from geoimp_drake.systems.cooperative_reference_generator import CooperativeReferenceGenerator
from geoimp_drake.systems.grasp_monitor import GraspMonitor
from geoimp_drake.systems.impedance_integrator import ImpedanceIntegrator
from geoimp_drake.systems.internal_impedance import InternalImpedance
from geoimp_drake.systems.last_motion import LastMotion
from geoimp_drake.systems.object_control import ObjectControl
from geoimp_drake.systems.reference_hold import ReferenceHold
from geoimp_drake.typing import Array

__all__ = ["OBJECT_PORTS", "WATCH_PORTS", "make_object_loop"]

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
        config: of the whole controller. With `fused` it is one system, if laws can be compiled
            (without numba they cannot) and the orientation family is the quaternion.
        gravity: g in W (3) [m/s²].
    """
    kinematics = CooperativeKinematics(config.load, gravity, config.wrench)
    impedance = config.impedance.make()
    references = CooperativeReferenceGenerator(config.mutual_pose)
    internal = None
    if config.internal.enabled:
        internal = config.internal.make("internal", config.sampling.period)
    watch = None
    if config.monitor.enabled:
        period = config.sampling.period
        watch = config.monitor.make(period), ReferenceHold(config.opened, period)
    removes_inertial_load = config.load.mass > 0 and config.load.inertial_load == "compliant"
    if config.fused and is_available() and config.impedance.orientation == "quaternion":
        return ObjectControl(
            kinematics,
            impedance,
            references,
            internal,
            watch,
            removes_inertial_load=removes_inertial_load,
        )
    return _separate(kinematics, impedance, references, internal, watch, removes_inertial_load)


def _separate(
    kinematics: CooperativeKinematics,
    impedance: ImpedanceIntegrator,
    references: CooperativeReferenceGenerator,
    internal: InternalImpedance | None,
    watch: tuple[GraspMonitor, ReferenceHold] | None,
    removes_inertial_load: bool,
) -> System:
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
    if removes_inertial_load:
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
