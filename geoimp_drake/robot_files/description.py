"""A robot's description as XML in memory: reads it, checks it, keeps what Drake's parser drops."""

import bisect
import itertools
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path

from pydrake.math import RigidTransform

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.robot_files.source import Place, lines_of, place_of, read_xml

__all__ = ["Description", "Site", "read_description"]

# Kinds of description by their outermost tag, as Drake's parser calls them.
_FORMATS = {"robot": "urdf", "sdf": "sdf", "mujoco": "xml"}


@dataclass(frozen=True)
class Site:
    """A named place S on a body B of an MJCF model."""

    name: str
    body: str
    X_BS: RigidTransform


@dataclass
class Description:
    """A robot's description.

    Attributes:
        file: where it was read.
        root: its XML.
        changes: all changes made to it, in words.
        sites: those of an MJCF, which have been taken out of it.
        aliases: present names by the names that the user may still write.
    """

    file: Path
    root: ET.Element
    changes: list[str] = field(default_factory=list)
    sites: list[Site] = field(default_factory=list)
    aliases: dict[str, str] = field(default_factory=dict)

    @property
    def format(self) -> str:
        """Returns urdf, sdf or xml (MJCF), as Drake's parser names them."""
        return _FORMATS[self.root.tag]

    def text(self) -> str:
        """Returns the XML as text, every element on a line of its own."""
        ET.indent(self.root, "")
        return ET.tostring(self.root, encoding="unicode")

    def place(self, line: int) -> Place:
        """Returns the line of the user's files that stands in a line of `text()`."""
        begun = bisect.bisect_right(lines_of(self.text()), line)
        place = Place(self.file, 1)
        for element in itertools.islice(self.root.iter(), begun):
            # An element that was added has no place of its own; it gets that of the one before it.
            place = place_of(element) or place
        return place

    def called(self, name: str | None) -> str | None:
        """Returns the present name of a link, joint or frame, by the user's name."""
        return None if name is None else self.aliases.get(name, name)

    def take_out_followers(self) -> set[str]:
        """Removes the coupling of joints to others; returns the joints that followed others."""
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
        ConfigurationError: there is no such file, or it is no XML (the message has the line) or
            none of the three.
    """
    root = read_xml(file)
    if root.tag not in _FORMATS:
        raise ConfigurationError(
            f"{file} begins with <{root.tag}>; a robot is a URDF (<robot>), an SDF (<sdf>) or an "
            f"MJCF (<mujoco>) file."
        )
    if any(element.tag.startswith("xacro:") for element in root.iter()):
        raise ConfigurationError(
            f"{file} is a xacro macro file; expand it first: xacro {file.name} > robot.urdf"
        )
    _inline(root, file.parent, (file,))
    return Description(file, root)


def _inline(element: ET.Element, folder: Path, within: tuple[Path, ...]) -> None:
    """Replaces MJCF's <include file="…"/> by what it names; a text has no folder to look in."""
    for place, child in reversed(list(enumerate(element))):
        if child.tag == "include" and "file" in child.attrib:
            file = folder / child.attrib["file"]
            if file in within:
                raise ConfigurationError(
                    f"{within[-1]} includes {file}, which includes it in turn."
                )
            included = read_xml(file)
            _inline(included, folder, (*within, file))
            element[place : place + 1] = list(included)
        else:
            _inline(child, folder, within)
