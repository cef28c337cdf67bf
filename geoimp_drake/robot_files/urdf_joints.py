"""URDF's joints of several degrees of freedom; an arm has one actuator for each joint."""

import xml.etree.ElementTree as ET

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.robot_files.description import Description
from geoimp_drake.robot_files.numbers import numbers
from geoimp_drake.robot_files.source import place_of
from geoimp_drake.robot_files.turns import least_turn_from_z

__all__ = ["decompose_planar_joints", "weld_floating_base"]

# Elements of a joint that its parts would have in another unit.
_OF_ALL = ("limit", "dynamics", "mimic", "safety_controller", "calibration")


def weld_floating_base(description: Description) -> None:
    """Fixes the joint with which a robot's base floats in its root.

    Raises:
        ConfigurationError: something else floats.
    """
    joints = {_link(joint, "child"): joint for joint in description.root.findall("joint")}
    for joint in joints.values():
        if joint.get("type") != "floating":
            continue
        before, seen = joints.get(_link(joint, "parent")), []
        while before is not None and before.get("type") == "fixed" and before not in seen:
            seen.append(before)
            before = joints.get(_link(before, "parent"))
        if before is not None:
            raise ConfigurationError(
                f"{place_of(joint)}: joint {joint.get('name')!r} floats beyond joint "
                f"{before.get('name')!r}. Only a robot's base may float, which is then welded to "
                f"base_pose; fix this joint in the file, or take out what is beyond it."
            )
        joint.set("type", "fixed")
        description.changes.append(
            f"floating base welded: link {_link(joint, 'child')} to {_link(joint, 'parent')}"
        )


def decompose_planar_joints(description: Description) -> None:
    """Replaces each planar joint by two prismatic ones and one about the plane's normal.

    The links between them have no mass. The first two are along the axes x and y that Drake gives
    to a planar joint, so that positions and their order stay.

    Raises:
        ConfigurationError: the normal is no direction.
    """
    root = description.root
    for joint in [joint for joint in root.findall("joint") if joint.get("type") == "planar"]:
        name, last = joint.get("name", ""), _link(joint, "child")
        axis = joint.find("axis")
        normal = np.array([1.0, 0.0, 0.0]) if axis is None else numbers(axis, "xyz", 3)
        if not normal.any():
            raise ConfigurationError(f"{place_of(joint)}: joint {name!r} has the normal 0 0 0.")
        along = least_turn_from_z(normal).matrix().T
        for old in [child for child in joint if child.tag in (*_OF_ALL, "axis", "child")]:
            joint.remove(old)
        parts = [f"{name}_x", f"{name}_y", f"{name}_turn"]
        kinds = ["prismatic", "prismatic", "continuous"]
        ends = [f"{parts[0]}_link", f"{parts[1]}_link", last]
        for k, (part, kind) in enumerate(zip(parts, kinds, strict=True)):
            element = joint if k == 0 else ET.SubElement(root, "joint")
            element.attrib |= {"name": part, "type": kind}
            if k > 0:
                ET.SubElement(element, "parent", link=ends[k - 1])
            ET.SubElement(element, "child", link=ends[k])
            ET.SubElement(element, "axis", xyz=" ".join(repr(float(x)) for x in along[k]))
            if k < 2:
                ET.SubElement(root, "link", name=ends[k])
        description.changes.append(f"planar joint {name} made of {', '.join(parts)}")


def _link(joint: ET.Element, end: str) -> str:
    element = joint.find(end)
    return "" if element is None else element.get("link", "")
