"""Filters of collisions between pairs of links, as in a robot's file."""

import xml.etree.ElementTree as ET
from collections.abc import Iterable

from pydrake.geometry import CollisionFilterDeclaration, SceneGraph
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake.robot_files.assembly import MOUNTING
from geoimp_drake.robot_files.description import Description

__all__ = ["filter_collisions", "filter_neighbours"]


def filter_collisions(description: Description, pairs: Iterable[tuple[str, str]]) -> None:
    """Lets Drake ignore contact between the links of each pair.

    Until the plant is finalized, Drake takes filters only from a description.
    """
    root = description.root
    model = root.find("model") if description.format == "sdf" else root
    for number, links in enumerate(pairs):
        if description.format == "xml":
            ET.SubElement(ET.SubElement(root, "contact"), "exclude", body1=links[0], body2=links[1])
        elif model is not None:
            _filter_group(model, description.format, f"neighbours_{number}", links)


def _filter_group(model: ET.Element, format: str, name: str, links: Iterable[str]) -> None:
    """Adds Drake's own element for links between which contact is ignored."""
    group = ET.SubElement(model, "drake:collision_filter_group", name=name)
    for link in links:
        _entry(group, "drake:member", format, link=link)
    _entry(group, "drake:ignored_collision_filter_group", format, name=name)


def _entry(group: ET.Element, tag: str, format: str, **attribute: str) -> None:
    """Adds an element whose value is an attribute in a URDF and the text in an SDF."""
    entry = ET.SubElement(group, tag, attribute if format == "urdf" else {})
    if format == "sdf":
        (entry.text,) = attribute.values()


def filter_neighbours(plant: MultibodyPlant, scene_graph: SceneGraph) -> None:
    """Filters collisions of links that were cut off, and of what they hold, with their neighbours.

    `load_robot` does so for the shapes of the file. Call this after adding shapes to the links.

    Args:
        plant: finalized.
        scene_graph: has its shapes.
    """
    joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
    inboard = {joint.child_body().index(): joint.parent_body() for joint in joints}
    if plant.get_adjacent_bodies_collision_filters():
        for weld in joints:
            if weld.parent_body().name() == f"{weld.name()}{MOUNTING}":
                pair = inboard[weld.parent_body().index()], weld.child_body()
                shapes = [plant.CollectRegisteredGeometries([body]) for body in pair]
                neighbours = CollisionFilterDeclaration().ExcludeBetween(*shapes)
                scene_graph.collision_filter_manager().Apply(neighbours)
