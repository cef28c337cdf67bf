"""Meshes that Drake does not read (STL, COLLADA and others), converted once and kept."""

import hashlib
import io
import logging
import shutil
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.extras import needs_extra

__all__ = ["convert_mesh", "is_read_by_drake", "mesh_cache"]

_log = logging.getLogger("drake")

_READ_BY_DRAKE = (".obj", ".gltf", ".vtk")
_OBJ, _MTL = "mesh.obj", "mesh.mtl"


def is_read_by_drake(mesh: Path) -> bool:
    """Returns whether Drake reads a mesh of this name."""
    return mesh.suffix.lower() in _READ_BY_DRAKE


def mesh_cache() -> Path:
    """Returns the user's folder for converted meshes.

    Raises:
        ConfigurationError: the packages of the extra `robots` are not installed.
    """
    with _converter():
        import platformdirs
    return platformdirs.user_cache_path("geoimp_drake") / "meshes"


def convert_mesh(mesh: Path, cache: Path | None = None) -> Path:
    """Returns the Wavefront OBJ of a mesh, in metres; converts it unless that was done before.

    As in ROS, it respects a file's unit but not its declaration of the axis that points up. The
    materials and textures are in an MTL file beside the OBJ.

    Args:
        mesh: of any format that trimesh reads.
        cache: folder for the results, each in a folder named after the mesh's content; by default
            one of the user's, see `mesh_cache`.

    Raises:
        ConfigurationError: the mesh cannot be read or is empty, or the extra `robots` is missing.
    """
    folder = (cache or mesh_cache()) / hashlib.sha256(mesh.read_bytes()).hexdigest()
    if not folder.is_dir():
        _write(_as_obj(mesh), folder)
    return (folder / _OBJ).resolve()


def _as_obj(mesh: Path) -> dict[str, bytes]:
    """Returns the files that a mesh becomes, by name."""
    with _converter():
        import collada  # noqa: F401  (COLLADA is read through it)
        from trimesh import load_scene
        from trimesh.exchange.obj import export_obj
    # Its many readers raise many kinds of exceptions.
    try:
        scene = _collada_scene(mesh) if mesh.suffix.lower() == ".dae" else load_scene(mesh)
        if scene.units not in (None, "meters"):
            scene = scene.convert_units("meters")
        _as_materials(scene.geometry.values())
        text, beside = export_obj(scene, include_color=False, return_texture=True, mtl_name=_MTL)
        is_empty = not any(len(part.faces) for part in scene.dump())
    except Exception as error:
        raise ConfigurationError(
            f"The mesh {mesh} cannot be read: {error or type(error).__name__}. Repair it, or leave "
            f"the geometry out with geometry 'leave-out'."
        ) from error
    if is_empty:
        raise ConfigurationError(
            f"The mesh {mesh} has no triangles. Repair it, or leave the geometry out with geometry "
            f"'leave-out'."
        )
    # Drake reads an OBJ of one object.
    lines = [line for line in text.splitlines() if not line.startswith("o ")]
    return {_OBJ: "\n".join([*lines, ""]).encode(), **beside}


def _collada_scene(mesh: Path) -> Any:
    """Returns a COLLADA file's scene; if one material is broken, it leaves all out.

    The reader would otherwise leave out the shapes with such a material.
    """
    from collada import Collada, DaeError
    from trimesh import load_scene

    broken = Collada(str(mesh), ignore=[DaeError]).errors
    if not broken:
        return load_scene(mesh)
    _log.warning(f"{mesh} is shown without its materials: {broken[0].msg}.")
    root = ET.fromstring(mesh.read_bytes())
    for parent in root.iter():
        for bound in parent.findall("{*}bind_material"):
            parent.remove(bound)
    return load_scene(io.BytesIO(ET.tostring(root)), file_type="dae")


def _as_materials(parts: Iterable[Any]) -> None:
    """Gives the parts of a mesh materials that an MTL file can hold.

    Of several colours of vertices or faces it takes the commonest. It does not darken a texture.
    """
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import PBRMaterial, SimpleMaterial

    for part in parts:
        visual = part.visual
        if visual.kind in ("vertex", "face"):
            part.visual = TextureVisuals(material=SimpleMaterial(diffuse=visual.main_color))
        elif isinstance(getattr(visual, "material", None), PBRMaterial):
            simple = visual.material.to_simple()
            if simple.image is not None and visual.material.baseColorFactor is None:
                simple.diffuse = np.full(4, 255, dtype=np.uint8)
            visual.material = simple


def _write(files: dict[str, bytes], target: Path) -> None:
    """Writes a folder under another name first, since another process may write the same mesh."""
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        partial = Path(tempfile.mkdtemp(dir=target.parent, suffix=".part"))
        for name, content in files.items():
            (partial / name).write_bytes(content)
        try:
            partial.rename(target)
        except OSError:
            shutil.rmtree(partial)
            if not target.is_dir():
                raise
    except OSError as error:
        raise ConfigurationError(
            f"The converted mesh {target} cannot be written: {error.strerror}. Give another folder "
            f"with load_robot(cache=…) or the environment variable XDG_CACHE_HOME."
        ) from error


def _converter() -> AbstractContextManager[None]:
    instead = "Or leave the geometry out with geometry 'leave-out'."
    return needs_extra("robots", "Converting meshes", instead)
