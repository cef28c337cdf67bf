"""Inertias that a robot's description does not state, found from its shapes."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator

from pydrake.geometry import SceneGraphInspector
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import CalcSpatialInertia, RigidBody, SpatialInertia

from geoimp_drake.robot_files.description import Description
from geoimp_drake.robot_files.inertial_elements import read_inertial

__all__ = ["DENSITY", "inertia_of_shapes", "links_of_shapes"]

# Density of the solids by which links without mass are estimated [kg/m³].
DENSITY = 1000.0


def links_of_shapes(description: Description) -> list[str]:
    """Returns the moving links whose inertia follows from their shapes.

    In a URDF these are links without mass if all that is fixed to them has none either; in an MJCF,
    bodies without <inertial>. SDF gives a mass to every link.
    """
    if description.format == "sdf":
        return []
    return _urdf(description) if description.format == "urdf" else _mjcf(description)


def _urdf(description: Description) -> list[str]:
    mass: dict[str, float] = {}
    names = []
    for link in description.root.findall("link"):
        names.append(name := link.get("name", ""))
        carrier, inertial = _carrier(description, name), link.find("inertial")
        own = 0.0 if inertial is None else read_inertial(inertial, "urdf")[0]
        mass[carrier] = mass.get(carrier, 0.0) + own
    moved = {child for child, (_, kind) in _inboard(description).items() if kind != "fixed"}
    return [n for n in names if (c := _carrier(description, n)) in moved and mass[c] == 0]


def _mjcf(description: Description) -> list[str]:
    return [
        name
        for world in description.root.findall("worldbody")
        for name in _below(world, moved=False)
    ]


def _below(place: ET.Element, *, moved: bool) -> Iterator[str]:
    for body in place.findall("body"):
        moves = moved or body.find("joint") is not None
        if moves and body.find("inertial") is None and body.find("geom") is not None:
            yield body.get("name", "")
        yield from _below(body, moved=moves)


def _carrier(description: Description, link: str) -> str:
    """Returns the link nearest to the base among those that fixed joints connect to a link."""
    inboard, seen = _inboard(description), {link}
    while link in inboard and inboard[link][1] == "fixed" and inboard[link][0] not in seen:
        link = inboard[link][0]
        seen.add(link)
    return link


def _inboard(description: Description) -> dict[str, tuple[str, str]]:
    """Returns the link before each link of a URDF except the root, and the kind of joint."""
    inboard = {}
    for joint in description.root.findall("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        if parent is not None and child is not None:
            inboard[child.get("link", "")] = parent.get("link", ""), joint.get("type", "")
    return inboard


def inertia_of_shapes(
    description: Description,
    plant: MultibodyPlant,
    inspector: SceneGraphInspector,
    body: RigidBody,
) -> SpatialInertia | None:
    """Returns the inertia of a body's shapes about its origin, in B; None if they have no mass.

    For an MJCF it is Drake's. For a URDF it is that of solids of `DENSITY`, with the collision
    shapes or, without any, the visual ones.
    """
    if description.format == "xml":
        M_BBo_B = body.default_spatial_inertia()
        return M_BBo_B if M_BBo_B.get_mass() > 0 else None
    shapes = plant.GetCollisionGeometriesForBody(body) or plant.GetVisualGeometriesForBody(body)
    total: SpatialInertia | None = None
    for shape in shapes:
        M_SSo_S = CalcSpatialInertia(inspector.GetShape(shape), DENSITY)
        X_BS = inspector.GetPoseInFrame(shape)
        M_SBo_B = M_SSo_S.ReExpress(X_BS.rotation()).Shift(-X_BS.translation())
        total = M_SBo_B if total is None else total + M_SBo_B
    return total if total is not None and total.get_mass() > 0 else None
