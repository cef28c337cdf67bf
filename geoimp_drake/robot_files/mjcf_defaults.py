"""Attributes of an MJCF file's elements: their own, and those of `<default>` classes."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator

__all__ = ["DefaultClasses", "in_bodies"]

_TORQUE = {"gaintype": "fixed", "biastype": "none", "dyntype": "none", "gainprm": "1"}
_SERVO = {"gaintype": "fixed", "biastype": "affine"}
_VARYING = {"gaintype": "affine"}
# Each kind of actuator is short for a general one with such attributes; a class has one set of
# them.
_SHORTCUTS = {
    "motor": _TORQUE,
    **dict.fromkeys(("position", "velocity", "intvelocity", "cylinder", "orientation"), _SERVO),
    **dict.fromkeys(("damper", "muscle", "adhesion", "dcmotor", "pid", "plugin"), _VARYING),
}
_MAIN = "main"
_Class = dict[str, dict[str, str]]  # attributes by kind of element


class DefaultClasses:
    """The classes of an MJCF's `<default>` sections, each with its inherited attributes."""

    def __init__(self, root: ET.Element):
        self._classes: dict[str, _Class] = {_MAIN: {}}
        for section in root.findall("default"):
            self._read(section, section.get("class", _MAIN), self._classes[_MAIN])

    def attributes(self, element: ET.Element, childclass: str | None = None) -> dict[str, str]:
        """Returns an element's attributes; its class gives those that the element lacks.

        An actuator's are those of the equivalent `<general>` one.

        Args:
            element: of a kind that has classes.
            childclass: that of the body around it.
        """
        name = element.get("class", childclass or _MAIN)
        inherited = self._classes.get(name, self._classes[_MAIN])
        return inherited.get(_kind(element), {}) | _own(element)

    def _read(self, section: ET.Element, name: str, inherited: _Class) -> None:
        own = dict(inherited)
        for child in section:
            own[_kind(child)] = own.get(_kind(child), {}) | _own(child)
        self._classes[name] = own
        for child in section.findall("default"):
            self._read(child, child.get("class", ""), own)


def _kind(element: ET.Element) -> str:
    return "general" if element.tag in _SHORTCUTS else element.tag


def _own(element: ET.Element) -> dict[str, str]:
    """Returns an element's own attributes, an actuator's as those of a general one."""
    gain = element.get("kp", element.get("kv"))
    own = element.attrib | _SHORTCUTS.get(element.tag, {})
    return own if gain is None else own | {"gainprm": gain}


def in_bodies(
    root: ET.Element, tag: str
) -> Iterator[tuple[ET.Element, list[ET.Element], str | None]]:
    """Yields an MJCF's elements with a tag, the bodies around each, and their childclass.

    The first body is the world.
    """
    for world in root.findall("worldbody"):
        yield from _below([world], tag, None)


def _below(
    bodies: list[ET.Element], tag: str, childclass: str | None
) -> Iterator[tuple[ET.Element, list[ET.Element], str | None]]:
    for child in bodies[-1]:
        if child.tag == tag:
            yield child, bodies, childclass
        if child.tag == "body":
            yield from _below([*bodies, child], tag, child.get("childclass", childclass))
