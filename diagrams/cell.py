"""The cell: an arm, its wrist sensor and its tool, put into somebody's MultibodyPlant.

    W ── base ─(track)─ waist … tool_roll ─ flange ═ mount ═[wrist_sensor]═ tool_side ═ tool: disk

Double lines are welds. The weld `wrist_sensor` carries everything that the sensor measures.
Model instances are called after the arm: `six`, `six_sensor`, `six_tool`, and the same for `seven`.
"""

from pathlib import Path

from pydrake.multibody.parsing import LoadModelDirectives, Parser, ProcessModelDirectives
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.models import package_map
from geoimp_drake.models.robot_data import ARM

__all__ = [
    "CELLS",
    "END_EFFECTOR",
    "FLANGE",
    "SEVEN",
    "SIX",
    "WRIST_SENSOR",
    "add_cell",
    "joint_names",
]

SIX = "six"
SEVEN = "seven"
FLANGE = "flange"
WRIST_SENSOR = "wrist_sensor"
END_EFFECTOR = "disk"

_FOLDER = Path(__file__).resolve().parent
_SUFFIX = ".dmd.yaml"
CELLS = tuple(sorted(path.name.removesuffix(_SUFFIX) for path in _FOLDER.glob("*" + _SUFFIX)))


def add_cell(plant: MultibodyPlant, cell: str) -> dict[str, ModelInstanceIndex]:
    """Adds the models of a cell to a plant that is not finalized yet.

    Args:
        plant: the plant; register it with a SceneGraph first if the cell is to be seen.
        cell: one of `CELLS`, the names of the model directives beside this file.

    Returns:
        The model instances that were added, by name.

    Raises:
        ConfigurationError: there is no such cell; the message lists those that there are.
    """
    if cell not in CELLS:
        raise ConfigurationError(f"no cell is called {cell!r}; choose from {', '.join(CELLS)}")
    parser = Parser(plant)
    parser.package_map().AddMap(package_map())
    directives = LoadModelDirectives(str(_FOLDER / (cell + _SUFFIX)))
    added = ProcessModelDirectives(directives, plant, parser)
    return {model.model_name: model.model_instance for model in added}


def joint_names(arm: str) -> tuple[str, ...]:
    """Returns the names of an arm's joints in the order of q, v and u; the track comes first."""
    revolute = tuple(joint.name for joint in ARM)
    return ("track", *revolute) if arm == SEVEN else revolute
