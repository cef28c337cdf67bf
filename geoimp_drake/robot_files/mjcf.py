"""Parts of MJCF that Drake's parser does not read: <frame>, and sites with any orientation."""

import xml.etree.ElementTree as ET
from collections.abc import Callable
from typing import ClassVar

import numpy as np
from pydrake.common.eigen_geometry import AngleAxis, Quaternion
from pydrake.math import RigidTransform, RotationMatrix

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.robot_files.description import Description, Site
from geoimp_drake.robot_files.numbers import numbers
from geoimp_drake.robot_files.source import place_of
from geoimp_drake.robot_files.turns import least_turn_from_z
from geoimp_drake.typing import Array

__all__ = ["expand_frames", "take_out_sites"]

_BODIES = ("body", "worldbody", "frame")
_AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def take_out_sites(description: Description) -> None:
    """Removes the sites of an MJCF model, which Drake would leave out, and keeps their poses.

    Sites given by their ends, and those of the world, are lost.
    """
    poses = _Poses(description.root)
    for body in [e for e in description.root.iter() if e.tag in ("body", "worldbody")]:
        for site in body.findall("site"):
            body.remove(site)
            if body.tag == "body" and site.get("name") and "fromto" not in site.attrib:
                place = Site(site.attrib["name"], body.get("name", ""), poses.of(site))
                description.sites.append(place)


def expand_frames(description: Description) -> None:
    """Moves the contents of a <frame> into the body around it; Drake would leave them out.

    Raises:
        ConfigurationError: a joint in a turned <frame> has its axis from a default class.
    """
    poses = _Poses(description.root)
    for body in [e for e in description.root.iter() if e.tag in ("body", "worldbody")]:
        _expand(body, poses)


def _expand(parent: ET.Element, poses: "_Poses") -> None:
    for place, frame in reversed(list(enumerate(parent))):
        if frame.tag != "frame":
            continue
        _expand(frame, poses)
        X_PF = poses.of(frame)
        for held in frame:
            _move(held, X_PF, poses)
            if "childclass" in frame.attrib:
                key = "childclass" if held.tag == "body" else "class"
                held.attrib.setdefault(key, frame.attrib["childclass"])
        parent[place : place + 1] = list(frame)


def _move(element: ET.Element, X_PF: RigidTransform, poses: "_Poses") -> None:
    """Expresses in P the pose of an element that is given in F."""
    if element.tag == "joint":
        if "axis" not in element.attrib and not X_PF.rotation().IsNearlyIdentity():
            raise ConfigurationError(
                f"{place_of(element)}: joint {element.get('name')!r} stands in a "
                f"turned <frame> and has no axis of its own; write its axis there."
            )
        element.set("pos", _text(X_PF @ numbers(element, "pos", 3, "0 0 0")))
        if "axis" in element.attrib:
            element.set("axis", _text(X_PF.rotation() @ numbers(element, "axis", 3)))
    elif "fromto" in element.attrib:
        ends = numbers(element, "fromto", 6).reshape(2, 3)
        element.set("fromto", " ".join(_text(X_PF @ end) for end in ends))
    elif element.tag != "freejoint":
        X_PE = X_PF @ poses.of(element)
        for key in _Poses.TURNS:
            element.attrib.pop(key, None)
        element.set("pos", _text(X_PE.translation()))
        element.set("quat", _text(X_PE.rotation().ToQuaternion().wxyz()))


class _Poses:
    """Reads poses by the settings of a model's compiler.

    Args:
        root: of the model.
    """

    def __init__(self, root: ET.Element):
        settings: dict[str, str] = {}
        for compiler in root.findall("compiler"):
            settings |= compiler.attrib
        self._unit = 1.0 if settings.get("angle") == "radian" else np.pi / 180.0
        self._sequence = settings.get("eulerseq", "xyz")

    def of(self, element: ET.Element) -> RigidTransform:
        """Returns the pose of an element in its parent."""
        return RigidTransform(self._turn(element), numbers(element, "pos", 3, "0 0 0"))

    def _turn(self, element: ET.Element) -> RotationMatrix:
        for key, read in self.TURNS.items():
            if key in element.attrib:
                return read(self, element)
        return RotationMatrix.Identity()

    def _quaternion(self, element: ET.Element) -> RotationMatrix:
        wxyz = numbers(element, "quat", 4)
        return RotationMatrix(Quaternion(wxyz / np.linalg.norm(wxyz)))

    def _euler(self, element: ET.Element) -> RotationMatrix:
        """In the compiler's order; lower-case letters mean turned axes."""
        R = RotationMatrix()
        for letter, angle in zip(self._sequence, numbers(element, "euler", 3), strict=True):
            turn = RotationMatrix(AngleAxis(angle * self._unit, np.array(_AXES[letter.lower()])))
            R = R @ turn if letter.islower() else turn @ R
        return R

    def _axis_angle(self, element: ET.Element) -> RotationMatrix:
        given = numbers(element, "axisangle", 4)
        axis = given[:3] / np.linalg.norm(given[:3])
        return RotationMatrix(AngleAxis(given[3] * self._unit, axis))

    def _two_axes(self, element: ET.Element) -> RotationMatrix:
        x, y = numbers(element, "xyaxes", 6).reshape(2, 3)
        x = x / np.linalg.norm(x)
        y = y - (x @ y) * x
        y = y / np.linalg.norm(y)
        return RotationMatrix(np.column_stack((x, y, np.linalg.cross(x, y))))

    def _z_axis(self, element: ET.Element) -> RotationMatrix:
        return least_turn_from_z(numbers(element, "zaxis", 3))

    TURNS: ClassVar[dict[str, Callable[["_Poses", ET.Element], RotationMatrix]]] = {
        "quat": _quaternion,
        "euler": _euler,
        "axisangle": _axis_angle,
        "xyaxes": _two_axes,
        "zaxis": _z_axis,
    }


def _text(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
