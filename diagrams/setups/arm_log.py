"""The log of one arm."""

from collections.abc import Mapping

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex
from pydrake.systems.framework import DiagramBuilder, OutputPort

from geoimp_drake.simulation.recorder import Recorder
from geoimp_drake.systems.sensing.frame_motion_sensor import FrameMotionSensor
from geoimp_drake.typing import Array

__all__ = ["record_arm", "slides", "true_motion"]

# Which positions of a joint are lengths, by its type; other types have none.
_LENGTHS = {"prismatic": (1.0,), "planar": (1.0, 1.0, 0.0), "rpy_floating": (0, 0, 0, 1, 1, 1)}


def record_arm(
    recorder: Recorder, plant: MultibodyPlant, arm: str, ports: Mapping[str, OutputPort]
) -> None:
    """Logs the joints of an arm, and further ports, under the arm's name.

    Args:
        recorder: of the diagram under construction.
        plant: contains the model instance `arm`.
        arm: its name, in the plant and in the log.
        ports: by the log's keys, such as u, motion_E, wrench.
    """
    instance = plant.GetModelInstanceByName(arm)
    n = plant.num_positions(instance)
    state = plant.get_state_output_port(instance)
    recorder.record(f"{arm}/q", state, slice(0, n))
    recorder.record(f"{arm}/v", state, slice(n, None))
    recorder.constant(f"{arm}/prismatic", slides(plant, instance))
    for key, port in ports.items():
        recorder.record(f"{arm}/{key}", port)


def slides(plant: MultibodyPlant, instance: ModelInstanceIndex) -> Array:
    """Returns, for each position of an arm, 1.0 if it is a length and 0.0 if it is an angle (n)."""
    slides = np.zeros(plant.num_positions())
    for joint in map(plant.get_joint, plant.GetJointIndices(instance)):
        start = joint.position_start()
        lengths = _LENGTHS.get(joint.type_name(), ())
        slides[start : start + len(lengths)] = lengths
    return plant.GetPositionsFromArray(instance, slides)


def true_motion(
    builder: DiagramBuilder, plant: MultibodyPlant, frame: Frame, name: str, path: Array | None
) -> OutputPort:
    """Adds a system `name` that reads the motion of a frame from the plant; returns its port.

    Args:
        builder: of the diagram.
        plant: the diagram's.
        frame: the one whose motion is read.
        name: of the system.
        path: to the frame, see `FrameMotionSensor`.
    """
    sensor = builder.AddNamedSystem(name, FrameMotionSensor(frame, path))
    for k in range(sensor.num_input_ports()):
        port = sensor.get_input_port(k)
        builder.Connect(plant.GetOutputPort(port.get_name()), port)
    return sensor.GetOutputPort("motion")
