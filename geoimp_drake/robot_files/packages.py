"""Finds the files that a robot's description names: `package://`, `file://` and plain paths."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from pathlib import Path

from pydrake.multibody.parsing import PackageMap

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.robot_files.source import Place

__all__ = ["find_package", "package_of", "resolve"]

_PACKAGE_SCHEMES = ("package://", "model://")
_MANIFEST = "package.xml"


def package_of(uri: str) -> str | None:
    """Returns the package that an address names, or None."""
    for scheme in _PACKAGE_SCHEMES:
        if uri.startswith(scheme):
            return uri.removeprefix(scheme).partition("/")[0]
    return None


def resolve(
    uri: str,
    file: Path,
    packages: Mapping[str, str | Path],
    folder: Path,
    place: Place | None = None,
) -> Path:
    """Returns the path of a file that a robot's description names.

    Args:
        uri: `package://name/path`, `model://name/path`, `file:///path` or a path.
        file: the description.
        packages: folders of packages by name; others are searched for, see `find_package`.
        folder: where relative paths start.
        place: its place in the description, for the error.

    Raises:
        ConfigurationError: there is no such package or file.
    """
    if (name := package_of(uri)) is not None:
        path = find_package(name, file, packages) / uri.partition("://")[2].partition("/")[2]
    else:
        path = folder / uri.removeprefix("file://")
    if not path.is_file():
        raise ConfigurationError(
            f"{place or file.name} names '{uri}', but there is no file {path}. Put it there, or "
            f"leave the geometry out with geometry 'leave-out' (links without inertia have it from "
            f"their shapes all the same)."
        )
    return path.resolve()


def find_package(name: str, file: Path, packages: Mapping[str, str | Path]) -> Path:
    """Returns the folder of a ROS package.

    It searches in this order: `packages`, the folders above `file` and those beside them, the
    environment variable ROS_PACKAGE_PATH. A folder is known by the name in its package.xml and by
    its own name, since published files use either.

    Raises:
        ConfigurationError: the package is not found, or the folder given for it does not exist.
    """
    if name in packages:
        given = Path(packages[name])
        if not given.is_dir():
            raise ConfigurationError(f"packages.{name} is {given}, which is not a folder.")
        return given.resolve()
    around = [folder for folder in _around(file, name) if folder.is_dir()]
    for name_of in (_name_of_manifest, lambda folder: folder.name):
        for folder in around:
            if name_of(folder) == name:
                return folder
    ros = PackageMap.MakeEmpty()
    ros.PopulateFromRosPackagePath()
    if ros.Contains(name):
        return Path(ros.GetPath(name))
    raise ConfigurationError(
        f"{file.name} names the package '{name}', which is neither above nor beside {file.parent} "
        f"nor in ROS_PACKAGE_PATH. Give its folder in packages, as {name}: FOLDER (or by --package "
        f"{name}=FOLDER)."
    )


def _around(file: Path, name: str) -> Iterator[Path]:
    """Yields the folders above a file, and beside each of them the folder with that name."""
    for folder in file.resolve().parents:
        yield folder
        yield folder / name


def _name_of_manifest(folder: Path) -> str | None:
    """Returns the name in a folder's package.xml, if it has one that can be read."""
    try:
        name = ET.parse(folder / _MANIFEST).getroot().findtext("name")
    except (OSError, ET.ParseError):
        return None
    return name.strip() if name else None
