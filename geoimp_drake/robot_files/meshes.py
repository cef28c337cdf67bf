"""Meshes that Drake does not read (STL, COLLADA and others), converted once and kept."""

import hashlib
import os
import tempfile
from pathlib import Path

from geoimp_drake.errors import ConfigurationError

__all__ = ["convert_mesh", "is_read_by_drake", "mesh_cache"]

_READ_BY_DRAKE = (".obj", ".gltf", ".vtk")


def is_read_by_drake(mesh: Path) -> bool:
    """Returns whether Drake reads a mesh of this name."""
    return mesh.suffix.lower() in _READ_BY_DRAKE


def mesh_cache() -> Path:
    """Returns the user's folder for converted meshes.

    Raises:
        ConfigurationError: the packages of the extra `robots` are not installed.
    """
    try:
        import platformdirs
    except ImportError as error:
        raise _missing(error) from None
    return platformdirs.user_cache_path("geoimp_drake") / "meshes"


def convert_mesh(mesh: Path, cache: Path | None = None) -> Path:
    """Returns the Wavefront OBJ of a mesh, in metres; converts it unless that has been done before.

    As in ROS, a file's unit is respected and its declaration of which axis points up is not.

    Args:
        mesh: of any format that trimesh reads.
        cache: folder for the result, which is named after the mesh's content; by default one of
            the user's, see `mesh_cache`.

    Raises:
        ConfigurationError: it cannot be read, it is empty, or the extra `robots` is missing.
    """
    folder = cache or mesh_cache()
    target = folder / f"{hashlib.sha256(mesh.read_bytes()).hexdigest()}.obj"
    if not target.is_file():
        _write(_as_obj(mesh), target)
    return target.resolve()


def _as_obj(mesh: Path) -> str:
    try:
        import collada  # noqa: F401  (trimesh reads COLLADA through it)
        import trimesh
    except ImportError as error:
        raise _missing(error) from None
    # What its many readers raise is not one kind of exception.
    try:
        scene = trimesh.load_scene(mesh)
        if scene.units not in (None, "meters"):
            scene = scene.convert_units("meters")
        surface = scene.to_mesh()
    except Exception as error:
        raise ConfigurationError(
            f"The mesh {mesh} cannot be read: {error or type(error).__name__}. Repair it, or leave "
            f"the geometry out with geometry 'leave-out'."
        ) from error
    if len(surface.faces) == 0:
        raise ConfigurationError(
            f"The mesh {mesh} has no triangles. Repair it, or leave the geometry out with geometry "
            f"'leave-out'."
        )
    return str(surface.export(file_type="obj", include_color=False, include_texture=False))


def _write(text: str, target: Path) -> None:
    """Writes under another name first: another process may want the same mesh."""
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, partial = tempfile.mkstemp(dir=target.parent, suffix=".part")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(partial, target)
    except OSError as error:
        raise ConfigurationError(
            f"The converted mesh {target} cannot be written: {error.strerror}. Give another folder "
            f"with load_robot(cache=…) or the environment variable XDG_CACHE_HOME."
        ) from error


def _missing(error: ImportError) -> ConfigurationError:
    return ConfigurationError(
        f"Converting meshes needs the package {error.name}: pip install 'geoimp-drake[robots]'. Or "
        f"leave the geometry out with geometry 'leave-out'."
    )
