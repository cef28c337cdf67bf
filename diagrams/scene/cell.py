"""The cell: an arm, its wrist sensor and its tool, added to a MultibodyPlant.

    W ── base ─(track)─ waist … tool_roll ─ flange ═ mount ═[wrist_sensor]═ tool_side ═ tool: disk

Double lines are welds. The weld `wrist_sensor` carries everything that the sensor measures. Model
instances are named after the arm: `six`, `six_sensor`, `six_tool`, and the same for `seven`.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from pydrake.multibody.parsing import (
    LoadModelDirectives,
    ModelDirectives,
    Parser,
    ProcessModelDirectives,
)
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.models import package_map
from geoimp_drake.models.robot_data import ARM
from geoimp_drake.typing import Array

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


def add_cell(
    plant: MultibodyPlant, cell: str, offsets: Mapping[str, Array] | None = None
) -> dict[str, ModelInstanceIndex]:
    """Adds the models of a cell to a plant that is not finalized yet.

    Args:
        plant: the plant; register it with a SceneGraph first if the cell is to be visible.
        cell: one of `CELLS`, the names of the model directives beside this file.
        offsets: displacements of the arms' bases, in W (3) [m].

    Returns:
        The model instances that were added, by name.

    Raises:
        ConfigurationError: there is no such cell; the message lists the valid names.
    """
    if cell not in CELLS:
        raise ConfigurationError(f"no cell is called {cell!r}; choose from {', '.join(CELLS)}")
    parser = Parser(plant)
    parser.package_map().AddMap(package_map())
    directives = LoadModelDirectives(str(_FOLDER / (cell + _SUFFIX)))
    for arm, offset in (offsets or {}).items():
        _displace(directives, arm, offset)
    added = ProcessModelDirectives(directives, plant, parser)
    return {model.model_name: model.model_instance for model in added}


def _displace(directives: ModelDirectives, arm: str, offset: Array) -> None:
    """Displaces the weld of an arm's base to the world."""
    for directive in directives.directives:
        weld = directive.add_weld
        if weld is not None and weld.parent == "world" and weld.child.startswith(f"{arm}::"):
            # Drake hands out a copy of the pose.
            X_PC = weld.X_PC
            X_PC.translation = np.ravel(X_PC.translation) + offset
            weld.X_PC = X_PC


def joint_names(arm: str) -> tuple[str, ...]:
    """Returns the names of an arm's joints in the order of q, v and u; the track comes first."""
    revolute = tuple(joint.name for joint in ARM)
    return ("track", *revolute) if arm == SEVEN else revolute
