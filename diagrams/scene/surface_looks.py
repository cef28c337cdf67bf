"""The looks of the surfaces in Meshcat: a sheet of glass, a carton, and the stand behind them.

Drawings only: none of these shapes takes part in contact. F is the middle of the front face, its z
axis outward.
"""

from collections.abc import Callable
from itertools import product

import numpy as np
from pydrake.geometry import Box, Cylinder
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from geoimp_drake.typing import Array

__all__ = ["APPEARANCES", "draw_stand"]

DARK = np.array([0.16, 0.17, 0.19, 1.0])
STEEL = np.array([0.55, 0.57, 0.60, 1.0])
SPACER = 0.05  # [m] from a sheet's back face to its stand
CARTON_DEPTH = 0.25  # [m]
COLUMN = 0.09  # [m] side of the stand's column


def _draw_sheet(
    plant: MultibodyPlant, plate: RigidBody, X_PF: RigidTransform, size: Array, color: Array
) -> None:
    """Draws a transparent sheet whose edges catch the light, on four dark spacers."""
    width, height, thickness = size
    _box(plant, plate, X_PF, "sheet", size, [0.0, 0.0, -thickness / 2], color)
    edge = np.append(0.7 * np.asarray(color)[:3], 0.5)
    for i, sign in enumerate((-1.0, 1.0)):
        x, y = sign * width / 2, sign * height / 2
        _box(
            plant,
            plate,
            X_PF,
            f"edge_x{i}",
            [0.004, height, thickness],
            [x, 0.0, -thickness / 2],
            edge,
        )
        _box(
            plant,
            plate,
            X_PF,
            f"edge_y{i}",
            [width, 0.004, thickness],
            [0.0, y, -thickness / 2],
            edge,
        )
    for i, (sx, sy) in enumerate(product((-0.44, 0.44), repeat=2)):
        p_FG = np.array([sx * width, sy * height, -thickness - SPACER / 2])
        X_PG = X_PF @ RigidTransform(p_FG)
        plant.RegisterVisualGeometry(plate, X_PG, Cylinder(0.012, SPACER), f"spacer{i}", DARK)
    frame = [width, height, 0.008]
    _box(plant, plate, X_PF, "frame", frame, [0.0, 0.0, -thickness - SPACER], STEEL)


def _draw_carton(
    plant: MultibodyPlant, plate: RigidBody, X_PF: RigidTransform, size: Array, color: Array
) -> None:
    """Draws a closed carton with its flaps' seam and a strip of tape across the front."""
    width, height, _ = size
    depth = CARTON_DEPTH
    _box(plant, plate, X_PF, "carton", [width, height, depth], [0.0, 0.0, -depth / 2], color)
    shade, tape = np.append(0.6 * np.asarray(color)[:3], 1.0), np.array([0.85, 0.78, 0.60, 1.0])
    # A little in front of the carton, or the two would flicker.
    _box(plant, plate, X_PF, "seam", [width, 0.003, 0.002], [0.0, 0.0, 0.0], shade)
    _box(plant, plate, X_PF, "tape", [width + 0.001, 0.05, 0.001], [0.0, 0.0, 0.0], tape)
    for i, (sx, sy) in enumerate(product((-0.5, 0.5), repeat=2)):
        corner = [sx * width, sy * height, -depth / 2]
        _box(plant, plate, X_PF, f"corner{i}", [0.004, 0.004, depth], corner, shade)


def draw_stand(plant: MultibodyPlant, name: str, X_WF: RigidTransform, thickness: float) -> None:
    """Draws a column on the floor z = 0 that reaches the back of the surface, if that is above."""
    x, y, z = X_WF @ np.array([0.0, 0.0, -thickness - SPACER - COLUMN / 2])
    top = z + COLUMN / 2
    if top < COLUMN:
        return
    world, X_WW = plant.world_body(), RigidTransform()
    _box(plant, world, X_WW, f"{name}_column", [COLUMN, COLUMN, top], [x, y, top / 2], STEEL)
    _box(plant, world, X_WW, f"{name}_foot", [4 * COLUMN, 4 * COLUMN, 0.02], [x, y, 0.01], DARK)


def _box(
    plant: MultibodyPlant,
    body: RigidBody,
    X_BF: RigidTransform,
    name: str,
    size: Array | list[float],
    p_FG: list[float],
    color: Array,
) -> None:
    X_BG = X_BF @ RigidTransform(np.asarray(p_FG))
    plant.RegisterVisualGeometry(body, X_BG, Box(*size), name, np.asarray(color))


APPEARANCES: dict[
    str, Callable[[MultibodyPlant, RigidBody, RigidTransform, Array, Array], None]
] = {
    "carton": _draw_carton,
    "sheet": _draw_sheet,
}
