"""A robot's file as a description that Drake reads: what is done before a plant has it."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from geoimp_drake.robot_files.actuators import take_out_drives
from geoimp_drake.robot_files.description import Description, read_description
from geoimp_drake.robot_files.drive import Drive
from geoimp_drake.robot_files.geometry import leave_out_geometry, place_meshes
from geoimp_drake.robot_files.inertia import (
    DENSITY,
    check_inertias,
    estimate_inertia,
    links_without_mass,
    set_inertia,
)
from geoimp_drake.robot_files.messages import silent
from geoimp_drake.robot_files.mjcf import expand_frames
from geoimp_drake.robot_files.numbers import check_numbers
from geoimp_drake.robot_files.parsing import parse, trial_plant

__all__ = ["Prepared", "prepare"]


class Prepared(NamedTuple):
    """A robot's description as Drake reads it, and what was taken out of it.

    Attributes:
        description: the rest.
        drives: of the joints.
        followers: joints that followed others.
    """

    description: Description
    drives: dict[str, Drive]
    followers: set[str]


def prepare(
    file: Path, packages: Mapping[str, Path], geometry: str, cache: Path | None
) -> Prepared:
    """Reads a robot's file and makes of it what Drake reads.

    Args:
        file: the description.
        packages: folders of packages by name.
        geometry: what is done with its shapes, see `load_robot`.
        cache: folder for converted meshes; the user's by default.

    Raises:
        ConfigurationError: a file, mesh or package is missing or cannot be read.
        ModelError: an inertia that no body can have.
    """
    description = read_description(file)
    check_numbers(description)
    expand_frames(description)
    check_inertias(description)
    drives = take_out_drives(description)
    followers = description.take_out_followers()
    if geometry == "leave-out":
        leave_out_geometry(description)
    else:
        place_meshes(description, packages, convert=geometry == "convert", cache=cache)
    _estimate_masses(description)
    return Prepared(description, drives, followers)


def _estimate_masses(description: Description) -> None:
    """Gives URDF links that move without any mass that of their shapes as solids."""
    links = links_without_mass(description)
    if not links:
        return
    plant, scene_graph = trial_plant()
    with silent():
        instance = parse(description, plant, {})
    done = []
    for link in links:
        body = plant.GetBodyByName(link, instance)
        M_BBo_B = estimate_inertia(plant, scene_graph.model_inspector(), body)
        if M_BBo_B is not None:
            set_inertia(description, link, M_BBo_B)
            done.append(f"{link} {M_BBo_B.get_mass():.3g} kg")
    if done:
        description.changes.append(
            f"links without mass estimated as solids of {DENSITY:g} kg/m³: {', '.join(done)}"
        )
