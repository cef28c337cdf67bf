"""A self-contained HTML page that replays a run in Meshcat."""

import logging
from pathlib import Path

from pydrake.geometry import Meshcat

__all__ = ["start_meshcat", "write_replay"]


def start_meshcat(
    camera: tuple[float, float, float], target: tuple[float, float, float]
) -> Meshcat:
    """Returns a Meshcat whose camera looks from a point in W to another."""
    level = logging.getLogger("drake").level
    logging.getLogger("drake").setLevel(logging.WARNING)  # the server's address is of no use here
    meshcat = Meshcat()
    logging.getLogger("drake").setLevel(level)
    meshcat.SetCameraPose(camera, target)
    meshcat.SetProperty("/Background", "top_color", [0.93, 0.95, 0.97])
    meshcat.SetProperty("/Background", "bottom_color", [0.80, 0.84, 0.88])
    return meshcat


def write_replay(meshcat: Meshcat, path: Path) -> None:
    """Writes what has been recorded as one HTML file."""
    path.write_text(meshcat.StaticHtml(), encoding="utf-8")
