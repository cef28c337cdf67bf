"""Prepares a robot's file: makes of it a description that Drake reads."""

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import NamedTuple

from geoimp_drake.robot_files.actuators import take_out_drives
from geoimp_drake.robot_files.description import Description, read_description
from geoimp_drake.robot_files.drive import Drive
from geoimp_drake.robot_files.geometry import leave_out_geometry, place_meshes, place_textures
from geoimp_drake.robot_files.inertia import DENSITY, inertia_of_shapes, links_of_shapes
from geoimp_drake.robot_files.inertia_repair import InertiaFault, repair_inertias
from geoimp_drake.robot_files.inertial_elements import set_inertia
from geoimp_drake.robot_files.looks import keep_looks_only
from geoimp_drake.robot_files.messages import silent
from geoimp_drake.robot_files.mjcf import expand_frames, take_out_sites
from geoimp_drake.robot_files.numbers import check_numbers
from geoimp_drake.robot_files.parsing import parse, trial_plant
from geoimp_drake.robot_files.repair import repair
from geoimp_drake.robot_files.sdf_includes import inline_models
from geoimp_drake.robot_files.sdf_nesting import flatten_models

__all__ = ["Prepared", "prepare"]

# The choices for geometry that remove shapes, except those of some links, and their messages.
_TAKEN_OUT: dict[str, tuple[Callable[[Description, Collection[str]], None], str]] = {
    "leave-out": (leave_out_geometry, "geometry left out"),
    "visual": (keep_looks_only, "shapes for looks only, without collision"),
}


class Prepared(NamedTuple):
    """A robot's description as Drake reads it, and what was removed from it.

    Attributes:
        description: the remaining description.
        drives: of the joints.
        followers: joints that followed others.
        faults: inertias that were replaced by the nearest possible ones.
    """

    description: Description
    drives: dict[str, Drive]
    followers: set[str]
    faults: list[InertiaFault]


def prepare(
    file: Path, packages: Mapping[str, Path], geometry: str, cache: Path | None
) -> Prepared:
    """Reads a robot's file and makes of it a description that Drake reads.

    Args:
        file: the description.
        packages: folders of packages by name.
        geometry: how to treat its shapes, see `load_robot`.
        cache: folder for converted meshes; the user's by default.

    Raises:
        ConfigurationError: a file, mesh or package is missing or cannot be read.
        ModelError: a mass is negative, or an inertia infinite.
    """
    description = read_description(file)
    if description.format == "sdf":
        inline_models(description.root, file, packages)
        flatten_models(description)
    check_numbers(description)
    expand_frames(description)
    repair(description)
    take_out_sites(description)
    faults = repair_inertias(description)
    drives = take_out_drives(description)
    followers = description.take_out_followers()
    take_out, said = _TAKEN_OUT.get(geometry, (None, ""))
    of_shapes = links_of_shapes(description) if take_out or description.format == "urdf" else []
    if take_out is not None:
        take_out(description, of_shapes)
    place_meshes(description, packages, convert=geometry != "keep", cache=cache)
    place_textures(description, packages)
    _give_inertias(description, of_shapes)
    if take_out is not None:
        take_out(description, ())
        description.changes.append(said)
    return Prepared(description, drives, followers, faults)


def _give_inertias(description: Description, links: Collection[str]) -> None:
    """Writes the inertias that follow from the links' shapes into the description."""
    if not links:
        return
    plant, scene_graph = trial_plant()
    with silent():
        instance = parse(description, plant, {})
    done = []
    for link in links:
        body = plant.GetBodyByName(link, instance)
        M_BBo_B = inertia_of_shapes(description, plant, scene_graph.model_inspector(), body)
        if M_BBo_B is not None:
            set_inertia(description, link, M_BBo_B)
            done.append(f"{link} {M_BBo_B.get_mass():.3g} kg")
    if done and description.format == "urdf":
        description.changes.append(
            f"links without mass estimated as solids of {DENSITY:g} kg/m³: {', '.join(done)}"
        )
