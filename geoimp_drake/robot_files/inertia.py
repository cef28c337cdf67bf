"""Inertias in a robot's description: checked, and estimated where a URDF has none."""

import xml.etree.ElementTree as ET

import numpy as np
from pydrake.geometry import SceneGraphInspector
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    CalcSpatialInertia,
    RigidBody,
    RotationalInertia,
    SpatialInertia,
)

from geoimp_drake.errors import ModelError
from geoimp_drake.robot_files.description import Description

__all__ = ["DENSITY", "check_inertias", "estimate_inertia", "links_without_mass", "set_inertia"]

# Of the solids by which links without mass are estimated [kg/m³].
DENSITY = 1000.0

_MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
_LINK = {"urdf": "link", "sdf": "link", "xml": "body"}


def check_inertias(description: Description) -> None:
    """Raises ModelError, naming link and numbers, where no body can have such an inertia."""
    for link in description.root.iter(_LINK[description.format]):
        if (inertial := link.find("inertial")) is None:
            continue
        name = link.get("name", "without name")
        mass, moments = _READERS[description.format](inertial)
        _check(name, mass, moments)


def _check(link: str, mass: float, moments: list[float]) -> None:
    numbers = ", ".join(f"{n} {value:g}" for n, value in zip(_MOMENTS, moments, strict=True))
    stated = f"Link '{link}' has mass {mass:g} kg and inertia {numbers} kg m²"
    if not np.isfinite([mass, *moments]).all() or mass < 0:
        raise ModelError(f"{stated}: give finite numbers and a mass that is not negative.")
    if mass == 0 and any(moments):
        raise ModelError(f"{stated}: without mass there is no inertia. Give its mass.")
    xx, yy, zz, xy, xz, yz = moments
    principal = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if not RotationalInertia(*moments).CouldBePhysicallyValid():
        raise ModelError(
            f"{stated}, which no body can have: of the principal moments "
            f"{', '.join(f'{value:.4g}' for value in principal)}, none may be negative or larger "
            f"than the sum of the other two. Correct the file."
        )


def _urdf(inertial: ET.Element) -> tuple[float, list[float]]:
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    given = inertia.attrib if inertia is not None else {}
    return (
        float(mass.get("value", "0")) if mass is not None else 0.0,
        [float(given.get(name, "0")) for name in _MOMENTS],
    )


def _sdf(inertial: ET.Element) -> tuple[float, list[float]]:
    # SDF's own defaults: 1 kg, 1 kg m².
    defaults = ["1"] * 3 + ["0"] * 3
    moments = [
        float(inertial.findtext(f"inertia/{name}", default))
        for name, default in zip(_MOMENTS, defaults, strict=True)
    ]
    return float(inertial.findtext("mass", "1")), moments


def _mjcf(inertial: ET.Element) -> tuple[float, list[float]]:
    given = inertial.get("fullinertia", inertial.get("diaginertia", "0 0 0")).split()
    moments = [float(number) for number in given]
    return float(inertial.get("mass", "0")), moments + [0.0] * (6 - len(moments))


_READERS = {"urdf": _urdf, "sdf": _sdf, "xml": _mjcf}


def links_without_mass(description: Description) -> list[str]:
    """Returns the links of a URDF that are moved but have no mass, nor has what is fixed to them.

    SDF gives a mass to every link, and MJCF takes it from the shapes.
    """
    if description.format != "urdf":
        return []
    mass: dict[str, float] = {}
    links = description.root.findall("link")
    for link in links:
        inertial, carrier = link.find("inertial"), _carrier(description, link.get("name", ""))
        mass[carrier] = mass.get(carrier, 0.0) + (0.0 if inertial is None else _urdf(inertial)[0])
    moved = {child for child, (_, kind) in _inboard(description).items() if kind != "fixed"}
    names = [link.get("name", "") for link in links]
    return [n for n in names if (c := _carrier(description, n)) in moved and mass[c] == 0]


def _carrier(description: Description, link: str) -> str:
    """Returns the link that fixed joints make one with a link, nearest to the base."""
    inboard, seen = _inboard(description), {link}
    while link in inboard and inboard[link][1] == "fixed" and inboard[link][0] not in seen:
        link = inboard[link][0]
        seen.add(link)
    return link


def _inboard(description: Description) -> dict[str, tuple[str, str]]:
    """Returns, for each link of a URDF but the root, the link before it and the kind of joint."""
    inboard = {}
    for joint in description.root.findall("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        if parent is not None and child is not None:
            inboard[child.get("link", "")] = parent.get("link", ""), joint.get("type", "")
    return inboard


def estimate_inertia(
    plant: MultibodyPlant, inspector: SceneGraphInspector, body: RigidBody
) -> SpatialInertia | None:
    """Returns the inertia of a body's shapes as solids of `DENSITY`, about its origin, in B.

    The shapes are those of collision, or else the visual ones; None if there are none or if their
    mesh encloses no volume.
    """
    shapes = plant.GetCollisionGeometriesForBody(body) or plant.GetVisualGeometriesForBody(body)
    total: SpatialInertia | None = None
    for shape in shapes:
        M_SSo_S = CalcSpatialInertia(inspector.GetShape(shape), DENSITY)
        X_BS = inspector.GetPoseInFrame(shape)
        M_SBo_B = M_SSo_S.ReExpress(X_BS.rotation()).Shift(-X_BS.translation())
        total = M_SBo_B if total is None else total + M_SBo_B
    return total if total is not None and total.get_mass() > 0 else None


def set_inertia(description: Description, link: str, M_BBo_B: SpatialInertia) -> None:
    """Writes a link's inertia into a URDF."""
    element = next(e for e in description.root.findall("link") if e.get("name") == link)
    for old in element.findall("inertial"):
        element.remove(old)
    p_BoBcm = M_BBo_B.get_com()
    I_Bcm = M_BBo_B.Shift(p_BoBcm).CalcRotationalInertia().CopyToFullMatrix3()
    inertial = ET.SubElement(element, "inertial")
    ET.SubElement(inertial, "origin", xyz=" ".join(f"{x:.9g}" for x in p_BoBcm))
    ET.SubElement(inertial, "mass", value=f"{M_BBo_B.get_mass():.9g}")
    entries = I_Bcm[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    ET.SubElement(
        inertial,
        "inertia",
        {name: f"{value:.9g}" for name, value in zip(_MOMENTS, entries, strict=True)},
    )
