"""What controllers of one and of two arms share: the compiled form, and sensors among blocks."""

import logging
from collections.abc import Mapping, Sequence
from functools import cache

from pydrake.systems.framework import DiagramBuilder, InputPort, OutputPort, System

from geoimp_drake.compilation.compiled import is_available
from geoimp_drake.parts.part import Part
from geoimp_drake.parts.passivity import Passivity
from geoimp_drake.parts.wrist_sensors import WristSensors
from geoimp_drake.systems.adaptive_damping import AdaptiveDamping
from geoimp_drake.systems.part_system import PartSystem, system_of
from geoimp_drake.systems.passive_gains import PassiveGains
from geoimp_drake.systems.sensing.force_torque_sensor import ForceTorqueSensors

__all__ = ["add_passivity", "connect_wrenches", "make_compiled", "warn_uncompiled"]

_log = logging.getLogger("drake")


def make_compiled(part: Part) -> PartSystem:
    """Returns a whole controller as one system; warns once if its laws are not compiled."""
    if not is_available():
        warn_uncompiled()
    return system_of(part)


@cache
def warn_uncompiled() -> None:
    """Warns that the compiled form is slower here; once in a process."""
    _log.warning(
        "The controller's form is 'compiled', but laws cannot be compiled here, and uncompiled it "
        "is slower than the form 'blocks'. Install numba (the extra 'fast'), or choose 'blocks'."
    )


def add_passivity(
    builder: DiagramBuilder,
    compliant: System,
    passivity: Passivity,
    measured: OutputPort,
    wrenches: list[InputPort],
) -> None:
    """Adds the blocks that keep an impedance passive, and exports their ports.

    Without a block for changing gains, `stiffness_scale` of the impedance is exported.

    Args:
        builder: where it is added.
        compliant: the block of the impedance, whose desired motion is exported already.
        passivity: its part.
        measured: motion of E.
        wrenches: the ports that get the wrench; that of the adaptive damping is added.
    """
    if passivity.damping is not None:
        damping = builder.AddNamedSystem("damping", AdaptiveDamping.of(passivity.damping))
        wrenches.append(damping.GetInputPort("wrench"))
        builder.Connect(measured, damping.GetInputPort("measured_motion"))
        scale = "damping_scale"
        builder.Connect(damping.GetOutputPort(scale), compliant.GetInputPort(scale))
        for output in passivity.damping.outputs:
            builder.ExportOutput(damping.GetOutputPort(output.name), output.name)
    if passivity.gains is None:
        builder.ExportInput(compliant.GetInputPort("stiffness_scale"), "stiffness_scale")
        return
    gains = builder.AddNamedSystem("passive_gains", PassiveGains.of(passivity.gains))
    builder.ConnectInput("desired_motion", gains.GetInputPort("desired_motion"))
    motion = "compliant_motion"
    builder.Connect(compliant.GetOutputPort(motion), gains.GetInputPort(motion))
    for name in ("stiffness", "damping"):
        builder.Connect(gains.GetOutputPort(name), compliant.GetInputPort(name))
    for name in passivity.inputs:
        builder.ExportInput(gains.GetInputPort(name), name)
    builder.ExportOutput(gains.GetOutputPort("tank"), "tank")


def connect_wrenches(
    builder: DiagramBuilder,
    sensors: WristSensors | None,
    wrenches: Mapping[str, Sequence[InputPort]],
    references: Mapping[str, OutputPort],
) -> None:
    """Gives the blocks of a controller their wrenches, once its other ports are exported.

    Args:
        builder: of the controller.
        sensors: the part of the wrist sensors, which are added; None if wrenches are inputs.
        wrenches: by name, the input ports that get each wrench.
        references: by name of a sensors' input port, the output port of that reference motion.
    """
    if sensors is None:
        for name, (first, *others) in wrenches.items():
            builder.ExportInput(first, name)
            for target in others:
                builder.ConnectInput(name, target)
        return
    system = builder.AddNamedSystem("wrist_sensors", ForceTorqueSensors.of(sensors))
    for name, targets in wrenches.items():
        for target in targets:
            builder.Connect(system.GetOutputPort(name), target)
    for name, reference in references.items():
        builder.Connect(reference, system.GetInputPort(name))
    for name in sensors.plant_inputs:
        builder.ExportInput(system.GetInputPort(name), name)
    for output in sensors.outputs:
        builder.ExportOutput(system.GetOutputPort(output.name), output.name)
