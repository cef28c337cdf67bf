"""The drives of a robot's joints, read from its description; Drake's parser drops much of them.

Each joint of an arm gets one actuator that takes a torque. Its effort limit, rotor inertia and gear
ratio come from the description's motors, servos and transmissions.
"""

import math
import xml.etree.ElementTree as ET

from geoimp_drake.robot_files.description import Description
from geoimp_drake.robot_files.drive import Drive, number
from geoimp_drake.robot_files.mjcf_drives import mjcf_drives

__all__ = ["take_out_drives"]

_ROTOR, _GEAR = "drake:rotor_inertia", "drake:gear_ratio"


def take_out_drives(description: Description) -> dict[str, Drive]:
    """Removes actuators and springs from a description; returns the drive of each joint."""
    return _READERS[description.format](description)


def _urdf(description: Description) -> dict[str, Drive]:
    drives = {}
    for joint in description.root.findall("joint"):
        name = joint.get("name", "")
        limit, dynamics = joint.find("limit"), joint.find("dynamics")
        drives[name] = Drive(
            effort_limit=_limit(None if limit is None else limit.get("effort")),
            friction=_of(dynamics, "friction"),
        )
    for transmission in description.root.findall("transmission"):
        description.root.remove(transmission)
        joints, actuators = transmission.findall("joint"), transmission.findall("actuator")
        # Drake has no transmissions of several joints, such as a differential's.
        if len(joints) == len(actuators) == 1 and (name := joints[0].get("name", "")) in drives:
            drives[name] = _with_transmission(drives[name], actuators[0])
    return drives


def _with_transmission(drive: Drive, actuator: ET.Element) -> Drive:
    name = actuator.get("name", "")
    return drive.with_actuator(
        name,
        rotor=_of(actuator.find(_ROTOR), "value"),
        gear=_of(actuator.find(_GEAR), "value", 1.0),
    )


def _of(element: ET.Element | None, attribute: str, default: float = 0.0) -> float:
    text = None if element is None else element.get(attribute)
    return number(text, default)


def _sdf(description: Description) -> dict[str, Drive]:
    drives = {}
    for joint in description.root.iter("joint"):
        if (axis := joint.find("axis")) is not None:
            name = joint.get("name", "")
            drives[name] = Drive(
                actuator=name,
                effort_limit=_limit(axis.findtext("limit/effort")),
                rotor_inertia=number(joint.findtext(_ROTOR)),
                gear_ratio=number(joint.findtext(_GEAR), 1.0),
                friction=number(axis.findtext("dynamics/friction")),
                stiffness=_take_spring_out(axis),
            )
    return drives


def _take_spring_out(axis: ET.Element) -> float:
    """Returns its stiffness; Drake would add a force element, and changes no joints after that."""
    stiffness = 0.0
    for dynamics in axis.findall("dynamics"):
        for spring in dynamics.findall("spring_stiffness"):
            stiffness = number(spring.text)
            dynamics.remove(spring)
    return stiffness


def _limit(text: str | None) -> float:
    """Returns an effort limit; zero or less means that it was not filled in."""
    limit = number(text)
    return limit if limit > 0 else math.inf


_READERS = {"urdf": _urdf, "sdf": _sdf, "xml": mjcf_drives}
