"""Passes a description to Drake's parser, and finds the frames that the robot then has."""

from collections.abc import Mapping
from pathlib import Path

from pydrake.geometry import SceneGraph
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, Frame, ModelInstanceIndex

from geoimp_drake.errors import ConfigurationError, ModelError, drake_errors
from geoimp_drake.robot_files.description import Description
from geoimp_drake.robot_files.messages import in_users_words
from geoimp_drake.validation import unknown_name

__all__ = ["find_frame", "named_frames", "parse", "trial_plant"]


def parse(
    description: Description, plant: MultibodyPlant, packages: Mapping[str, Path]
) -> ModelInstanceIndex:
    """Adds a robot to a plant, as its present description states it.

    Args:
        description: of one robot.
        plant: not finalized.
        packages: folders of packages by name, for files other than meshes.

    Raises:
        ConfigurationError: Drake's parser refuses it.
        ModelError: it holds several models, or none.
    """
    parser = Parser(plant)
    # The robot's own name may be taken; it gets the user's.
    parser.SetAutoRenaming(True)
    for name, folder in packages.items():
        if not parser.package_map().Contains(name):
            parser.package_map().Add(name, str(folder))
    refused = drake_errors(ConfigurationError, f"Drake cannot read {description.file}")
    with refused, in_users_words(description):
        models = parser.AddModelsFromString(description.text(), description.format)
    if len(models) != 1:
        raise ModelError(
            f"{description.file} holds {len(models)} models; a robot's file holds one."
        )
    return models[0]


def trial_plant() -> tuple[MultibodyPlant, SceneGraph]:
    """Returns a plant to try a description on, and the scene graph with its shapes."""
    scene_graph = SceneGraph()
    plant = MultibodyPlant(time_step=1e-3)
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    return plant, scene_graph


def find_frame(
    description: Description, plant: MultibodyPlant, instance: ModelInstanceIndex, name: str
) -> Frame:
    """Returns a link's frame, a frame or a site of a robot by its name.

    Raises:
        ModelError: there is none of that name; the message lists those that exist.
    """
    name = description.aliases.get(name, name)
    _add_sites(description, plant, instance)
    if not plant.HasFrameNamed(name, instance):
        raise ModelError(str(unknown_name(name, "frame", _frame_names(plant, instance))))
    return plant.GetFrameByName(name, instance)


def named_frames(
    description: Description, plant: MultibodyPlant, instance: ModelInstanceIndex
) -> list[str]:
    """Returns the names that `find_frame` knows of a robot."""
    _add_sites(description, plant, instance)
    return _frame_names(plant, instance)


def _add_sites(
    description: Description, plant: MultibodyPlant, instance: ModelInstanceIndex
) -> None:
    for site in description.sites:
        taken = plant.HasFrameNamed(site.name, instance)
        if not taken and plant.HasBodyNamed(site.body, instance):
            B = plant.GetFrameByName(site.body, instance)
            plant.AddFrame(FixedOffsetFrame(site.name, B, site.X_BS, instance))


def _frame_names(plant: MultibodyPlant, instance: ModelInstanceIndex) -> list[str]:
    """Returns the frames that the file names, without those that Drake adds."""
    joints = [plant.get_joint(index).name() for index in plant.GetJointIndices(instance)]
    own = {f"{joint}_{end}" for joint in joints for end in ("parent", "child")} | {"__model__"}
    names = [plant.get_frame(index).name() for index in plant.GetFrameIndices(instance)]
    return [name for name in names if name and name not in own]
