"""The shapes in a robot's description: meshes found and converted, or everything left out."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from pathlib import Path

from geoimp_drake.robot_files.description import Description
from geoimp_drake.robot_files.meshes import convert_mesh, is_read_by_drake
from geoimp_drake.robot_files.packages import resolve

__all__ = ["GEOMETRY", "leave_out_geometry", "place_meshes"]

# What is done with a robot's shapes.
GEOMETRY = ("convert", "keep", "leave-out")


def place_meshes(
    description: Description,
    packages: Mapping[str, str | Path],
    *,
    convert: bool,
    cache: Path | None,
) -> None:
    """Names every mesh by its full path, since a description in memory has no folder.

    Args:
        description: changed in place.
        packages: folders of packages by name.
        convert: convert meshes that Drake does not read.
        cache: folder for converted meshes; the user's by default.

    Raises:
        ConfigurationError: a mesh or its package is missing, or a mesh cannot be converted.
    """
    folder = _mesh_folder(description)
    converted = set()
    for holder, key in _meshes(description):
        mesh = resolve(_address(holder, key), description.file, packages, folder)
        if convert and not is_read_by_drake(mesh):
            converted.add(mesh)
            mesh = convert_mesh(mesh, cache)
        _set_address(holder, key, mesh)
    if converted:
        kinds = ", ".join(sorted({mesh.suffix.lstrip(".").upper() for mesh in converted}))
        description.changes.append(f"{len(converted)} meshes converted ({kinds})")


def leave_out_geometry(description: Description) -> None:
    """Takes all shapes out, but for those that alone define the inertia of an MJCF body."""
    for link in description.root.iter("link"):
        for tag in ("visual", "collision"):
            for shape in link.findall(tag):
                link.remove(shape)
    for body in description.root.iter("body"):
        if body.find("inertial") is not None:
            for geom in body.findall("geom"):
                body.remove(geom)
    _leave_out_unused_meshes(description.root)
    description.changes.append("geometry left out")


def _leave_out_unused_meshes(mujoco: ET.Element) -> None:
    used = {geom.get("mesh") for geom in mujoco.iter("geom")}
    for asset in mujoco.findall("asset"):
        for mesh in asset.findall("mesh"):
            if mesh.get("name", Path(mesh.get("file", "")).stem) not in used:
                asset.remove(mesh)


def _meshes(description: Description) -> Iterator[tuple[ET.Element, str | None]]:
    """Yields where meshes are named: an element and its attribute, or None for its text."""
    for mesh in description.root.iter("mesh"):
        if description.format == "sdf":
            yield from ((uri, None) for uri in mesh.findall("uri"))
        else:
            key = "filename" if description.format == "urdf" else "file"
            if key in mesh.attrib:
                yield mesh, key


def _address(holder: ET.Element, key: str | None) -> str:
    return (holder.text or "").strip() if key is None else holder.attrib[key]


def _set_address(holder: ET.Element, key: str | None, mesh: Path) -> None:
    if key is None:
        holder.text = f"file://{mesh}"
    elif key == "file":
        # An MJCF mesh without a name has that of its file.
        holder.attrib.setdefault("name", Path(holder.attrib[key]).stem)
        holder.attrib[key] = str(mesh)
    else:
        holder.attrib[key] = f"file://{mesh}"


def _mesh_folder(description: Description) -> Path:
    """Returns where relative paths start: the file's folder, or what an MJCF's compiler says."""
    folder = description.file.resolve().parent
    for compiler in description.root.findall("compiler"):
        inner = compiler.get("meshdir", compiler.get("assetdir"))
        if inner is not None:
            return folder / inner
    return folder
