"""Numbers in a robot's description; Drake reads "150 Nm" as 150 and "-1,5" as -1."""

import xml.etree.ElementTree as ET

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.robot_files.description import Description
from geoimp_drake.robot_files.source import place_of
from geoimp_drake.typing import Array
from geoimp_drake.validation import quoted

__all__ = ["check_numbers", "numbers"]

_INERTIA = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
# URDF's attributes by tag.
_URDF = {
    "origin": ("xyz", "rpy"),
    "axis": ("xyz",),
    "limit": ("lower", "upper", "effort", "velocity"),
    "dynamics": ("damping", "friction"),
    "mass": ("value",),
    "inertia": _INERTIA,
    "mimic": ("multiplier", "offset"),
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "mesh": ("scale",),
    **dict.fromkeys(("drake:rotor_inertia", "drake:gear_ratio"), ("value",)),
}
# MJCF's attributes, of any element.
_MJCF = (
    *("pos", "quat", "euler", "axisangle", "xyaxes", "zaxis", "fromto", "axis", "range"),
    *("mass", "diaginertia", "fullinertia", "armature", "damping", "stiffness", "frictionloss"),
    *("actuatorfrcrange", "forcerange", "ctrlrange", "gear", "gainprm", "kp", "kv"),
)
# SDF's elements.
_SDF = (
    *("pose", "mass", *_INERTIA, "xyz", "lower", "upper", "effort", "velocity"),
    *("damping", "friction", "spring_stiffness", "radius", "length", "scale"),
    *("drake:rotor_inertia", "drake:gear_ratio"),
)
# How many numbers Drake expects; its own message has no line.
_COUNTS = {
    **dict.fromkeys(("xyz", "rpy", "pos", "euler", "zaxis", "axis", "diaginertia"), 3),
    **dict.fromkeys(("lower", "upper", "effort", "velocity", "value", "mass", *_INERTIA), 1),
    **dict.fromkeys(("radius", "length", "multiplier", "offset"), 1),
    "quat": 4,
    "axisangle": 4,
    "xyaxes": 6,
    "fromto": 6,
    "fullinertia": 6,
}
# These may be infinite; all others must be so small that their squares do not overflow.
_ENDLESS = (
    *("lower", "upper", "effort", "velocity", "range", "actuatorfrcrange", "forcerange"),
    "ctrlrange",
)
_LARGEST = 1e30
# The contents of these elements are for other programs.
_FOREIGN = ("gazebo", "plugin", "sensor", "custom", "keyframe")


def numbers(element: ET.Element, key: str, count: int, default: str | None = None) -> Array:
    """Returns the numbers of an attribute.

    Raises:
        ConfigurationError: there are not `count` numbers; the message has file and line.
    """
    text = element.get(key, default or "")
    try:
        values = np.array([float(number) for number in text.split()])
    except ValueError:
        raise _no_number(element, element.get("name"), key, text) from None
    if len(values) != count:
        raise _no_number(element, element.get("name"), key, text, f"{count} numbers")
    return values


def check_numbers(description: Description) -> None:
    """Raises ConfigurationError, with file and line, where something else stands for a number.

    It does not read materials, sensors and elements meant for simulators.
    """
    _check(description.root, None, description.format)


def _check(element: ET.Element, owner: str | None, format: str) -> None:
    owner = element.get("name", owner)
    if format == "sdf":
        text = (element.text or "").strip()
        stated = {element.tag: text} if element.tag in _SDF and text else {}
    else:
        keys = _URDF.get(element.tag, ()) if format == "urdf" else _MJCF
        stated = {key: element.attrib[key] for key in keys if key in element.attrib}
    for key, text in stated.items():
        stated_numbers = text.split() or [""]
        for number in stated_numbers:
            _check_number(element, owner, key, number, text)
        if (count := _COUNTS.get(key, len(stated_numbers))) != len(stated_numbers):
            raise _no_number(element, owner, key, text, f"{count} numbers")
    for child in element:
        if child.tag not in _FOREIGN:
            _check(child, owner, format)
    if element.tag == "joint":
        _check_range(element, format)


def _check_range(joint: ET.Element, format: str) -> None:
    """Raises ConfigurationError if the lower limit is above the upper: Drake would abort."""
    if format == "xml":
        low, high = numbers(joint, "range", 2, "0 0")
    elif format == "urdf":
        limit = joint.find("limit")
        if limit is None or joint.get("type") not in ("revolute", "prismatic"):
            return
        low, high = (float(limit.get(key, "0")) for key in ("lower", "upper"))
    else:
        low = float(joint.findtext("axis/limit/lower", "").strip() or "-inf")
        high = float(joint.findtext("axis/limit/upper", "").strip() or "inf")
    if low > high:
        raise ConfigurationError(
            f"{place_of(joint)}: the limits of joint {quoted(joint.get('name'))} are {low:g} and "
            f"{high:g}, the lower above the upper; exchange them, or remove them if the joint has "
            "no limits."
        )


def _check_number(element: ET.Element, owner: str | None, key: str, number: str, text: str) -> None:
    try:
        value = np.nan if "_" in number else float(number)
    except ValueError:
        value = np.nan
    if np.isnan(value) and number != "auto":
        raise _no_number(element, owner, key, text)
    if abs(value) > _LARGEST and key not in _ENDLESS:
        raise _no_number(element, owner, key, text, f"a number below {_LARGEST:g}")


def _no_number(
    element: ET.Element, owner: str | None, key: str, text: str, wanted: str = "a number"
) -> ConfigurationError:
    place = place_of(element)
    where = f"{place}: " if place else ""
    what = f"<{element.tag}>" if key == element.tag else f"<{element.tag} {key}=…>"
    of = f" of {quoted(owner)}" if owner else ""
    return ConfigurationError(
        f"{where}{what}{of} is {quoted(text)}; give {wanted} in SI units, without the unit."
    )
