"""The drives of an MJCF's joints: armatures, motors and servos, through its default classes."""

import math
import xml.etree.ElementTree as ET

from geoimp_drake.robot_files.description import Description
from geoimp_drake.robot_files.drive import Drive
from geoimp_drake.robot_files.mjcf_defaults import DefaultClasses, in_bodies

__all__ = ["mjcf_drives"]

# Actuator dynamics through which a bounded control gives a bounded force.
_DIRECT_DYNAMICS = ("none", "filter", "filterexact")
_UNKNOWN_TO_DRAKE = {"actuatorfrcrange", "actuatorfrclimited", "frictionloss", "stiffness"}


def mjcf_drives(description: Description) -> dict[str, Drive]:
    """Removes actuators and tendons from an MJCF; returns the drive of each joint.

    Actuators that act on no joint, and gravity compensation, are left out; `changes` says so. A
    joint without a name gets one.
    """
    root = description.root
    reader = _Reader(root)
    drives = reader.joints()
    _take_attributes_out(root)
    left_out: dict[str, list[str]] = {"actuators": []}
    for actuator in _take_out(root, "actuator"):
        attributes = reader.classes.attributes(actuator)
        joint = attributes.get("joint", attributes.get("jointinparent", ""))
        name = attributes.get("name", joint)
        if joint in drives:
            drives[joint] = reader.driven(drives[joint], name, attributes)
        else:
            left_out["actuators"].append(name or actuator.tag)
    left_out["tendons"] = [t.get("name", t.tag) for t in _take_out(root, "tendon")]
    left_out["gravity compensation"] = [
        body.get("name", "body") for body in root.iter("body") if body.get("gravcomp", "0") != "0"
    ]
    description.changes += [f"{k} left out: {', '.join(v)}" for k, v in left_out.items() if v]
    return drives


def _take_attributes_out(root: ET.Element) -> None:
    """Removes the attributes of joints, and of joints in classes, that Drake would only warn of."""
    for joint in root.iter("joint"):
        for name in _UNKNOWN_TO_DRAKE & joint.attrib.keys():
            del joint.attrib[name]


def _take_out(root: ET.Element, tag: str) -> list[ET.Element]:
    """Removes all sections with a tag; returns their children."""
    sections = root.findall(tag)
    for section in sections:
        root.remove(section)
    return [child for section in sections for child in section]


class _Reader:
    """Reads the joints and actuators of an MJCF as MuJoCo does."""

    def __init__(self, root: ET.Element):
        self._root = root
        self.classes = DefaultClasses(root)
        compilers = root.findall("compiler")
        self._autolimits = all(c.get("autolimits", "true") == "true" for c in compilers)

    def joints(self) -> dict[str, Drive]:
        """Returns the drives of all joints, still without actuators."""
        drives: dict[str, Drive] = {}
        for joint, bodies, childclass in in_bodies(self._root, "joint"):
            if "name" not in joint.attrib:
                joint.set("name", _name(bodies, drives))
            attributes = self.classes.attributes(joint, childclass)
            drives[joint.attrib["name"]] = Drive(
                effort_limit=self._limit(attributes, "actuatorfrc"),
                rotor_inertia=_first(attributes, "armature"),
                friction=_first(attributes, "frictionloss"),
                stiffness=_first(attributes, "stiffness"),
            )
        return drives

    def driven(self, drive: Drive, name: str, attributes: dict[str, str]) -> Drive:
        """Returns a drive with one more actuator."""
        gear = _first(attributes, "gear", 1.0)
        is_motor = _takes_torque(attributes)
        limit = self._limit(attributes, "force")
        if is_motor and attributes.get("dyntype", "none") in _DIRECT_DYNAMICS:
            gain = abs(_first(attributes, "gainprm", 1.0))
            limit = min(limit, gain * self._limit(attributes, "ctrl")) if gain else limit
        rotor = _first(attributes, "armature")
        return drive.with_actuator(
            name, rotor=rotor, gear=gear, limit=abs(gear) * limit, is_servo=not is_motor
        )

    def _limit(self, attributes: dict[str, str], kind: str) -> float:
        """Returns the smaller end of a range; infinity if the range does not apply.

        For a range that begins at zero, or has one sign, the limit is its larger end.
        """
        ends = attributes.get(f"{kind}range", "").split()
        stated = attributes.get(f"{kind}limited", "auto")
        if not ends or stated == "false" or (stated == "auto" and not self._autolimits):
            return math.inf
        low, high = (float(end) for end in (ends[0], ends[-1]))
        if low == high == 0:  # not filled in
            return math.inf
        return min(-low, high) if low < 0 < high else max(abs(low), abs(high))


def _name(bodies: list[ET.Element], taken: dict[str, Drive]) -> str:
    """Returns Drake's name for a joint without a name, or another one if that is taken."""
    names = [body.get("name", "body") for body in bodies[1:]]
    name = "-".join(["world", *names][-2:])
    return name if name not in taken else f"{name}-{len(taken)}"


def _takes_torque(attributes: dict[str, str]) -> bool:
    """Returns whether an actuator's force is its control times a constant."""
    types = attributes.get("gaintype", "fixed"), attributes.get("biastype", "none")
    return types == ("fixed", "none")


def _first(attributes: dict[str, str], key: str, default: float = 0.0) -> float:
    """Returns the first number of an attribute; Drake has no use for further ones."""
    numbers = attributes.get(key, "").split()
    return float(numbers[0]) if numbers else default
