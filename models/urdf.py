"""Elements of a URDF file: links made of solids and shapes, joints, motors."""

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
from pydrake.multibody.tree import SpatialInertia

__all__ = [
    "COLOURS",
    "Shape",
    "frame",
    "inertia_of",
    "joint",
    "link",
    "motor",
    "text",
    "to_text",
]

Element = ElementTree.Element
Numbers = Sequence[float]

COLOURS = {
    "red": (0.78, 0.25, 0.12, 1),
    "dark": (0.17, 0.18, 0.20, 1),
    "black": (0.05, 0.05, 0.06, 1),
    "steel": (0.66, 0.68, 0.70, 1),
    "wood": (0.76, 0.56, 0.34, 1),
    "yellow": (0.95, 0.72, 0.08, 1),
    "floor": (0.42, 0.45, 0.48, 1),
}
_SIZE_NAMES = {
    "box": ("size",),
    "cylinder": ("radius", "length"),
    "drake:capsule": ("radius", "length"),
    "sphere": ("radius",),
    "mesh": ("filename",),
}


@dataclass(frozen=True)
class Shape:
    """A primitive or a mesh to look at, placed in the link by `xyz` [m] and `rpy` [deg]."""

    kind: str
    size: tuple[float | str, ...]
    colour: str
    xyz: tuple[float, float, float] = (0, 0, 0)
    rpy: tuple[float, float, float] = (0, 0, 0)


def text(values: Numbers) -> str:
    """Writes numbers with 12 digits; the sum cleans -0."""
    return " ".join(f"{round(value, 12) + 0.0:.12g}" for value in values)


def inertia_of(solids: Sequence[tuple[SpatialInertia, Numbers]]) -> SpatialInertia:
    """Adds solids, each given by its inertia about its own centre and that centre in the link."""
    total = SpatialInertia.Zero()
    for inertia, centre in solids:
        total += inertia.Shift(-np.asarray(centre, dtype=float))
    return total


def link(name: str, inertia: SpatialInertia, shapes: Sequence[Shape], yaw: float = 0) -> Element:
    """Makes a link; its contents are described in a frame turned by `yaw` [deg] in it."""
    element = Element("link", name=name)
    element.append(_inertial(inertia, yaw))
    for shape in shapes:
        element.append(_visual(shape, yaw))
    return element


def joint(
    name: str,
    parent: str,
    child: str,
    *,
    kind: str = "revolute",
    xyz: Numbers = (0, 0, 0),
    rpy: Numbers = (0, 0, 0),
    axis: Numbers = (0, 0, 1),
) -> Element:
    """Makes a joint; `xyz` [m] and `rpy` [rad] place it in the parent link."""
    element = Element("joint", name=name, type=kind)
    ElementTree.SubElement(element, "parent", link=parent)
    ElementTree.SubElement(element, "child", link=child)
    ElementTree.SubElement(element, "origin", xyz=text(xyz), rpy=text(rpy))
    if kind != "fixed":
        ElementTree.SubElement(element, "axis", xyz=text(axis))
    return element


def motor(
    joint: Element,
    *,
    limits: tuple[float, float],
    effort: float,
    speed: float,
    viscous: float,
    rotor_inertia: float,
    gear_ratio: float,
) -> Element:
    """Gives the joint its limits and friction, and returns the transmission that drives it."""
    lower, upper, peak, fastest = text((*limits, effort, speed)).split()
    ElementTree.SubElement(joint, "limit", lower=lower, upper=upper, effort=peak, velocity=fastest)
    ElementTree.SubElement(joint, "dynamics", damping=text([viscous]))
    name = joint.attrib["name"]
    transmission = Element("transmission", name=name)
    ElementTree.SubElement(transmission, "type").text = "SimpleTransmission"
    ElementTree.SubElement(transmission, "joint", name=name)
    actuator = ElementTree.SubElement(transmission, "actuator", name=name)
    ElementTree.SubElement(actuator, "drake:rotor_inertia", value=text([rotor_inertia]))
    ElementTree.SubElement(actuator, "drake:gear_ratio", value=text([gear_ratio]))
    return transmission


def frame(name: str, link: str, xyz: Numbers = (0, 0, 0), rpy: Numbers = (0, 0, 0)) -> Element:
    """Makes a named frame fixed in a link; `xyz` [m], `rpy` [rad]."""
    return Element("frame", name=name, link=link, xyz=text(xyz), rpy=text(rpy))


def to_text(name: str, elements: Sequence[Element]) -> str:
    """Writes a robot as the text of a URDF file."""
    robot = Element("robot", {"name": name, "xmlns:drake": "https://drake.mit.edu"})
    robot.append(ElementTree.Comment(" Written by `python -m geoimp_drake.models.generate`. "))
    robot.extend(elements)
    ElementTree.indent(robot)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(robot, encoding="unicode") + "\n"


def _inertial(inertia: SpatialInertia, yaw: float) -> Element:
    element = Element("inertial")
    centre = inertia.get_com()
    moments = inertia.Shift(centre).CalcRotationalInertia().CopyToFullMatrix3()
    element.append(_origin(centre, (0, 0, 0), yaw))
    ElementTree.SubElement(element, "mass", value=text([inertia.get_mass()]))
    entries = {
        f"i{'xyz'[i]}{'xyz'[j]}": text([moments[i, j]]) for i in range(3) for j in range(i, 3)
    }
    ElementTree.SubElement(element, "inertia", entries)
    return element


def _visual(shape: Shape, yaw: float) -> Element:
    element = Element("visual")
    element.append(_origin(shape.xyz, shape.rpy, yaw))
    geometry = ElementTree.SubElement(element, "geometry")
    ElementTree.SubElement(geometry, shape.kind, _sizes(shape))
    material = ElementTree.SubElement(element, "material", name=shape.colour)
    ElementTree.SubElement(material, "color", rgba=text(COLOURS[shape.colour]))
    return element


def _sizes(shape: Shape) -> dict[str, str]:
    if shape.kind == "box":
        return {"size": text([float(side) for side in shape.size])}
    values = [s if isinstance(s, str) else text([s]) for s in shape.size]
    return dict(zip(_SIZE_NAMES[shape.kind], values, strict=True))


def _origin(xyz: Numbers, rpy: Numbers, yaw: float) -> Element:
    """Places by `xyz` [m] and `rpy` [deg] in a frame turned by `yaw` [deg] in the link."""
    c, s = np.cos(np.radians(yaw)), np.sin(np.radians(yaw))
    x, y, z = xyz
    roll, pitch, own_yaw = np.radians(rpy)
    position = (c * x - s * y, s * x + c * y, z)
    return Element("origin", xyz=text(position), rpy=text((roll, pitch, own_yaw + np.radians(yaw))))
