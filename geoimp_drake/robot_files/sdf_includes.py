"""Replaces an SDF's <include> elements by their models: a description in memory has no folder."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.robot_files.packages import find_package, package_of
from geoimp_drake.robot_files.source import place_of, read_xml

__all__ = ["inline_models"]

_MANIFEST, _DEFAULT = "model.config", "model.sdf"


def inline_models(root: ET.Element, file: Path, packages: Mapping[str, str | Path]) -> None:
    """Replaces every <include> of a model by that model.

    With `merge`, it becomes a model with that attribute, which `flatten_models` reads.

    Args:
        root: of the SDF, changed in place.
        file: the one that it was read from.
        packages: folders of packages by name.

    Raises:
        ConfigurationError: an address leads nowhere, to no SDF, or back to its own file.
    """
    for model in list(root.iter("model")):
        _inline(model, packages, (file.resolve(),))


def _inline(
    model: ET.Element, packages: Mapping[str, str | Path], within: tuple[Path, ...]
) -> None:
    for place, include in list(enumerate(model)):
        if include.tag == "include":
            file = _file_of(include, packages, within[-1])
            if file in within:
                raise ConfigurationError(f"{place_of(include)}: {file} includes itself.")
            model[place] = included = _model_of(include, file)
            for inner in included.iter("model"):
                _inline(inner, packages, (*within, file))


def _file_of(include: ET.Element, packages: Mapping[str, str | Path], file: Path) -> Path:
    uri = include.findtext("uri", "").strip()
    if (name := package_of(uri)) is not None:
        path = find_package(name, file, packages) / uri.partition("://")[2].partition("/")[2]
    else:
        path = file.parent / uri.removeprefix("file://")
    if path.is_dir():
        path = path / _named_by_manifest(path / _MANIFEST)
    if not uri or not path.is_file():
        raise ConfigurationError(
            f"{place_of(include)}: <include> names {uri!r}, but there is no file {path}."
        )
    return path.resolve()


def _named_by_manifest(manifest: Path) -> str:
    """Returns the model file that a folder's manifest names; of several, the last and newest."""
    listed = read_xml(manifest).findall("sdf") if manifest.is_file() else []
    return (listed[-1].text or _DEFAULT).strip() if listed else _DEFAULT


def _model_of(include: ET.Element, file: Path) -> ET.Element:
    """Returns the model of a file, with the name and the pose that the <include> gives it."""
    model = read_xml(file).find("model")
    if model is None:
        raise ConfigurationError(
            f"{place_of(include)}: {file} holds no SDF <model>; only those can be included."
        )
    for uri in model.iter("uri"):
        if uri.text and "://" not in uri.text:
            uri.text = str(file.parent / uri.text.strip())
    if name := include.findtext("name"):
        model.set("name", name.strip())
    if include.get("merge") in ("true", "1"):
        model.set("merge", "true")
    if (placement := include.findtext("placement_frame")) is not None:
        model.set("placement_frame", placement.strip())
    if (pose := include.find("pose")) is not None:
        for old in model.findall("pose"):
            model.remove(old)
        model.append(pose)
    return model
