"""Visual shapes, which touch nothing."""

import xml.etree.ElementTree as ET
from collections.abc import Collection

from geoimp_drake.robot_files.description import Description
from geoimp_drake.robot_files.mjcf_defaults import DefaultClasses, in_bodies

__all__ = ["keep_looks_only"]

# The elements of a shape that is not to collide.
_OF_LOOKS = ("origin", "pose", "geometry")
# Groups of an MJCF's geoms that MuJoCo and Drake show.
_SHOWN_GROUPS = ("0", "1", "2")


def keep_looks_only(description: Description, but: Collection[str] = ()) -> None:
    """Removes collision from all shapes except those of the links that are named.

    A link without visual shapes shows its collision shapes.
    """
    if description.format == "xml":
        _keep_looks_of_bodies(description.root, but)
    for link in description.root.iter("link"):
        if link.get("name") in but:
            continue
        has_looks = link.find("visual") is not None
        for shape in link.findall("collision"):
            if has_looks:
                link.remove(shape)
            else:
                shape.tag = "visual"
                for further in [part for part in shape if part.tag not in _OF_LOOKS]:
                    shape.remove(further)


def _keep_looks_of_bodies(mujoco: ET.Element, but: Collection[str]) -> None:
    classes = DefaultClasses(mujoco)
    hidden: dict[int, list[ET.Element]] = {}
    seen = set()
    for geom, bodies, childclass in in_bodies(mujoco, "geom"):
        if bodies[-1].get("name") in but:
            continue
        group = classes.attributes(geom, childclass).get("group", "0")
        if group in _SHOWN_GROUPS:
            seen.add(id(bodies[-1]))
        else:
            hidden.setdefault(id(bodies[-1]), []).append(geom)
        geom.attrib |= {"contype": "0", "conaffinity": "0"}
    for body, geoms in hidden.items():
        for geom in geoms if body not in seen else ():
            geom.set("group", "0")
