"""Rewrites parts of published descriptions that Drake's parser refuses."""

import xml.etree.ElementTree as ET
from copy import deepcopy

from geoimp_drake.robot_files.description import Description
from geoimp_drake.robot_files.inertial_elements import links, read_inertial
from geoimp_drake.robot_files.urdf_joints import decompose_planar_joints, weld_floating_base

__all__ = ["repair"]


def repair(description: Description) -> None:
    """Adds missing names, and gives each of several materials of one name its own.

    Floating bases are welded and planar joints become joints of one degree of freedom.

    Raises:
        ConfigurationError: a joint other than the base's floats, or an axis is no direction.
    """
    _name_model(description)
    if description.format == "urdf":
        _part_materials(description.root)
        decompose_planar_joints(description)
        weld_floating_base(description)
    if description.format == "xml":
        _name_bodies(description.root)
        _leave_out_zero_masses(description)
        _weld_free_bodies(description)


def _name_model(description: Description) -> None:
    key = "model" if description.format == "xml" else "name"
    models = description.root.iter("model") if description.format == "sdf" else [description.root]
    for model in models:
        model.set(key, model.get(key) or description.file.stem)


def _part_materials(root: ET.Element) -> None:
    """Writes the look of each material of a URDF to the places that use it.

    A name may stand for several colours, or for one that is defined further below. Without a
    colour, the shape has no material.
    """
    looks: dict[str, list[ET.Element]] = {}
    for material in root.iter("material"):
        if len(material):
            looks.setdefault(material.get("name", ""), list(material))
    for shape in root.iter("visual"):
        for material in shape.findall("material"):
            if not len(material):
                material.extend(deepcopy(looks.get(material.get("name", ""), [])))
            if not len(material):
                shape.remove(material)
    for material in root.findall("material"):
        root.remove(material)
    kinds: dict[str, list[str]] = {}
    for material in root.iter("material"):
        look = "".join(ET.tostring(child, "unicode").strip() for child in material)
        known = kinds.setdefault(name := material.get("name", ""), [])
        if look not in known:
            known.append(look)
        if number := known.index(look):
            material.set("name", f"{name}_{number + 1}")


def _name_bodies(root: ET.Element) -> None:
    """Gives bodies without a name the name that Drake would give, which depends on the plant."""
    names = {body.get("name") for body in root.iter("body")}
    for number, body in enumerate(root.iter("body"), start=1):
        if "name" not in body.attrib and (name := f"body{number}") not in names:
            body.set("name", name)


def _leave_out_zero_masses(description: Description) -> None:
    """Removes the <inertial> of bodies without mass, on which Drake would abort."""
    for body in links(description):
        for inertial in body.findall("inertial"):
            if read_inertial(inertial, "xml")[0] == 0:
                body.remove(inertial)
                for geom in body.findall("geom"):
                    geom.set("mass", "0")


def _weld_free_bodies(description: Description) -> None:
    """Welds free bodies to the world; the robot's root gets its base pose later."""
    welded = []
    for world in description.root.findall("worldbody"):
        for body in world.findall("body"):
            free = [*body.findall("freejoint"), *body.findall("joint[@type='free']")]
            for joint in free:
                body.remove(joint)
                welded.append(body.get("name", ""))
    if welded:
        description.changes.append(f"free bodies welded to the world: {', '.join(welded)}")
