"""A robot's description as XML in memory: read, checked, and asked what Drake's parser drops."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform

from geoimp_drake.errors import ConfigurationError

__all__ = ["Description", "Site", "read_description"]

# Kinds of description by their outermost tag, as Drake's parser calls them.
_FORMATS = {"robot": "urdf", "sdf": "sdf", "mujoco": "xml"}
_TURNED_OTHERWISE = {"euler", "axisangle", "xyaxes", "zaxis", "fromto"}


@dataclass(frozen=True)
class Site:
    """A named place S on a body B of an MJCF model, which Drake's parser leaves out."""

    name: str
    body: str
    X_BS: RigidTransform


@dataclass
class Description:
    """A robot's description.

    Attributes:
        file: where it was read.
        root: its XML.
        changes: what has been done to it, for people.
    """

    file: Path
    root: ET.Element
    changes: list[str] = field(default_factory=list)

    @property
    def format(self) -> str:
        """Returns urdf, sdf or xml (MJCF), as Drake's parser names them."""
        return _FORMATS[self.root.tag]

    def text(self) -> str:
        """Returns the XML as text."""
        return ET.tostring(self.root, encoding="unicode")

    def sites(self) -> Iterator[Site]:
        """Yields the sites of an MJCF model whose attitude is given by a quaternion or not at all.

        Others depend on the compiler's settings; they are left out, as Drake does.
        """
        for body in self.root.iter("body"):
            for site in body.findall("site"):
                if "name" in site.attrib and not _TURNED_OTHERWISE & site.attrib.keys():
                    quaternion = np.array(_floats(site.get("quat", "1 0 0 0")))
                    turned = Quaternion(quaternion / np.linalg.norm(quaternion))
                    X_BS = RigidTransform(turned, _floats(site.get("pos", "0 0 0")))
                    yield Site(site.attrib["name"], body.get("name", ""), X_BS)

    def take_out_followers(self) -> set[str]:
        """Takes the coupling of joints to others out; returns the joints that followed others."""
        followers = set()
        for joint in self.root.iter("joint"):
            for parent in (joint, *joint.findall("axis")):
                for mimic in parent.findall("mimic"):
                    parent.remove(mimic)
                    followers.add(joint.get("name", ""))
        for equality in self.root.findall("equality"):
            followers |= {joint.get("joint1", "") for joint in equality.findall("joint")}
            self.root.remove(equality)
        return followers


def read_description(file: Path) -> Description:
    """Reads a URDF, SDF or MJCF file.

    Raises:
        ConfigurationError: no such file, no XML (the message has the line), or none of the three.
    """
    root = _read(file)
    if root.tag not in _FORMATS:
        raise ConfigurationError(
            f"{file} begins with <{root.tag}>; a robot is a URDF (<robot>), an SDF (<sdf>) or an "
            f"MJCF (<mujoco>) file."
        )
    if any(element.tag.startswith("xacro:") for element in root.iter()):
        raise ConfigurationError(
            f"{file} is a xacro macro file; expand it first: xacro {file.name} > robot.urdf"
        )
    _inline(root, file.parent)
    return Description(file, root)


def _read(file: Path) -> ET.Element:
    builder = ET.TreeBuilder()
    # Names as they stand: Drake knows its own tags by their prefix, declared or not.
    parser = expat.ParserCreate()
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(file.read_bytes(), True)
    except OSError as error:
        raise ConfigurationError(
            f"The robot file {file.absolute()} cannot be read: {error.strerror}."
        ) from error
    except expat.ExpatError as error:
        raise ConfigurationError(f"{file} is not XML: {error}.") from error
    return builder.close()


def _inline(element: ET.Element, folder: Path) -> None:
    """Puts what MJCF's <include file="…"/> names into its place; text has no folder to look in."""
    for place, child in reversed(list(enumerate(element))):
        if child.tag == "include" and "file" in child.attrib:
            element[place : place + 1] = list(_read(folder / child.attrib["file"]))
    for child in element:
        _inline(child, folder)


def _floats(text: str) -> list[float]:
    return [float(number) for number in text.split()]
