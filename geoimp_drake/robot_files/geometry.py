"""Finds and converts the meshes in a robot's description, or leaves all its shapes out."""

import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.robot_files.description import Description
from geoimp_drake.robot_files.inertial_elements import links
from geoimp_drake.robot_files.meshes import convert_mesh, is_read_by_drake
from geoimp_drake.robot_files.packages import resolve
from geoimp_drake.robot_files.source import place_of

__all__ = ["GEOMETRY", "leave_out_geometry", "place_meshes", "place_textures"]

# The ways to treat a robot's shapes.
GEOMETRY = ("visual", "convert", "keep", "leave-out")


def place_meshes(
    description: Description,
    packages: Mapping[str, str | Path],
    *,
    convert: bool,
    cache: Path | None,
) -> None:
    """Gives every mesh its full path, since a description in memory has no folder.

    Args:
        description: changed in place.
        packages: folders of packages by name.
        convert: convert meshes that Drake does not read.
        cache: folder for converted meshes; the user's by default.

    Raises:
        ConfigurationError: a mesh or its package is missing, or a mesh cannot be converted.
    """
    folder = _mesh_folder(description)
    converted: dict[Path, Path] = {}
    for holder, key in _meshes(description):
        uri, place = _address(holder, key), place_of(holder)
        mesh = resolve(uri, description.file, packages, folder, place)
        if convert and not is_read_by_drake(mesh):
            if mesh not in converted:
                converted[mesh] = convert_mesh(mesh, cache)
            mesh = converted[mesh]
        _set_address(holder, key, mesh)
    if converted:
        kinds = ", ".join(sorted({mesh.suffix.lstrip(".").upper() for mesh in converted}))
        description.changes.append(f"{len(converted)} meshes converted ({kinds})")


def place_textures(description: Description, packages: Mapping[str, str | Path]) -> None:
    """Gives every texture its full path; leaves out missing ones."""
    folder = description.file.resolve().parent
    missing = set()
    for holder in list(description.root.iter()):
        for material in holder.findall("material"):
            textures = [e for e in material if e.tag in ("texture", "drake:diffuse_map")]
            for texture in textures:
                key = "filename" if texture.tag == "texture" else None
                uri = _address(texture, key)
                try:
                    path = resolve(uri, description.file, packages, folder)
                except ConfigurationError:
                    missing.add(uri)
                    material.remove(texture)
                else:
                    _set_address(texture, key, path)
            if textures and not len(material):
                holder.remove(material)
    if missing:
        description.changes.append(f"textures not found: {', '.join(sorted(missing))}")


def leave_out_geometry(description: Description, but: Collection[str] = ()) -> None:
    """Removes all shapes except those of the links that are named."""
    shapes = {"xml": ("geom",)}.get(description.format, ("visual", "collision"))
    for link in (*links(description), *description.root.iter("worldbody")):
        if link.get("name") not in but:
            for shape in [child for child in link if child.tag in shapes]:
                link.remove(shape)
    _leave_out_unused_meshes(description.root)


def _leave_out_unused_meshes(mujoco: ET.Element) -> None:
    used = {geom.get("mesh") for geom in mujoco.iter("geom")}
    for asset in mujoco.findall("asset"):
        for mesh in asset.findall("mesh"):
            if mesh.get("name", Path(mesh.get("file", "")).stem) not in used:
                asset.remove(mesh)


def _meshes(description: Description) -> Iterator[tuple[ET.Element, str | None]]:
    """Yields the places that name meshes: an element and its attribute, or None for its text."""
    for mesh in description.root.iter("mesh"):
        if description.format == "sdf":
            yield from ((uri, None) for uri in mesh.findall("uri"))
        else:
            key = "filename" if description.format == "urdf" else "file"
            if key in mesh.attrib:
                yield mesh, key


def _address(holder: ET.Element, key: str | None) -> str:
    return (holder.text or "").strip() if key is None else holder.get(key, "")


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
