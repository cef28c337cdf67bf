"""The <inertial> of links and bodies: read and written in the three kinds of description."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator

import numpy as np
from pydrake.multibody.tree import SpatialInertia

from geoimp_drake.robot_files.description import Description
from geoimp_drake.typing import Array

__all__ = ["MOMENTS", "inertials", "links", "read_inertial", "set_inertia", "write_inertial"]

# Moments and products of inertia in the order of URDF, SDF and MJCF's fullinertia.
MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
_LINK = {"urdf": "link", "sdf": "link", "xml": "body"}


def links(description: Description) -> Iterator[ET.Element]:
    """Yields the links; in an MJCF, the bodies."""
    return description.root.iter(_LINK[description.format])


def inertials(description: Description) -> Iterator[tuple[ET.Element, ET.Element]]:
    """Yields each link that has an <inertial>, with it."""
    for link in links(description):
        if (inertial := link.find("inertial")) is not None:
            yield link, inertial


def read_inertial(inertial: ET.Element, format: str) -> tuple[float, Array]:
    """Returns mass [kg], moments and products of inertia [kg m²], in the order of `MOMENTS`."""
    if format == "urdf":
        mass, inertia = inertial.find("mass"), inertial.find("inertia")
        given = {} if inertia is None else inertia.attrib
        texts = [given.get(name, "0") for name in MOMENTS]
        return float("0" if mass is None else mass.get("value", "0")), np.array(texts, float)
    if format == "sdf":
        # SDF's own defaults: 1 kg, 1 kg m².
        defaults = ["1"] * 3 + ["0"] * 3
        of = zip(MOMENTS, defaults, strict=True)
        texts = [inertial.findtext(f"inertia/{name}", default) for name, default in of]
        return float(inertial.findtext("mass", "1")), np.array(texts, float)
    stated = inertial.get("fullinertia", inertial.get("diaginertia", "0 0 0")).split()
    moments = np.array(stated + ["0"] * (6 - len(stated)), float)
    return float(inertial.get("mass", "0")), moments


def write_inertial(inertial: ET.Element, format: str, mass: float, moments: Array) -> None:
    """Replaces mass, moments and products; the point to which they refer stays."""
    texts = [repr(float(value)) for value in moments]
    if format == "xml":
        inertial.attrib.pop("diaginertia", None)
        inertial.attrib |= {"mass": repr(float(mass)), "fullinertia": " ".join(texts)}
        return
    for old in (*inertial.findall("mass"), *inertial.findall("inertia")):
        inertial.remove(old)
    of = zip(MOMENTS, texts, strict=True)
    if format == "urdf":
        ET.SubElement(inertial, "mass", value=repr(float(mass)))
        ET.SubElement(inertial, "inertia", dict(of))
    else:
        ET.SubElement(inertial, "mass").text = repr(float(mass))
        inertia = ET.SubElement(inertial, "inertia")
        for name, text in of:
            ET.SubElement(inertia, name).text = text


def set_inertia(description: Description, link: str, M_BBo_B: SpatialInertia) -> None:
    """Writes a link's inertia into a URDF or MJCF."""
    element = next(e for e in links(description) if e.get("name") == link)
    for old in element.findall("inertial"):
        element.remove(old)
    p_BoBcm = M_BBo_B.get_com()
    place = " ".join(repr(float(x)) for x in p_BoBcm)
    inertial = ET.SubElement(element, "inertial")
    if description.format == "urdf":
        ET.SubElement(inertial, "origin", xyz=place)
    else:
        inertial.set("pos", place)
    I_Bcm = M_BBo_B.Shift(p_BoBcm).CalcRotationalInertia().CopyToFullMatrix3()
    entries = I_Bcm[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    write_inertial(inertial, description.format, M_BBo_B.get_mass(), entries)
