"""A steel rod with its mounting plate, between a hand's wrist sensor and the part that it holds."""

import numpy as np
from pydrake.geometry import Box, Cylinder
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, Frame, RigidBody, SpatialInertia

from geoimp_drake.models.robot_data import TOOL
from geoimp_drake.models.urdf import inertia_of
from geoimp_drake.typing import Array

__all__ = ["STEEL", "add_rod", "draw", "mounting_face"]

STEEL = np.array([0.66, 0.68, 0.70, 1.0])


def mounting_face(plant: MultibodyPlant, arm: str) -> Frame:
    """Returns S, the face behind an arm's wrist sensor on which a tool is mounted, z forward."""
    return plant.GetFrameByName("tool_side", plant.GetModelInstanceByName(f"{arm}_sensor"))


def add_rod(plant: MultibodyPlant, arm: str, length: float, R_SE: RotationMatrix) -> Frame:
    """Adds a steel rod with its mounting plate to a hand; returns E at its end.

    Args:
        plant: not finalized, contains the arm and its sensor.
        arm: name of the arm.
        length: from the sensor to E [m].
        R_SE: orientation of E in the hand.
    """
    instance = plant.AddModelInstance(f"{arm}_tool")
    plate, rod = TOOL.plate_thickness, length - TOOL.plate_thickness
    parts = (
        (TOOL.plate_radius, plate, plate / 2),
        (TOOL.stick_radius, rod, plate + rod / 2),
    )
    solids = [
        (
            SpatialInertia.SolidCylinderWithDensity(
                TOOL.steel_density, radius, height, (0.0, 0.0, 1.0)
            ),
            (0.0, 0.0, middle),
        )
        for radius, height, middle in parts
    ]
    body = plant.AddRigidBody("tool", instance, inertia_of(solids))
    for index, (radius, height, middle) in enumerate(parts):
        draw(plant, body, middle, Cylinder(radius, height), f"rod{index}", STEEL)
    plant.WeldFrames(mounting_face(plant, arm), body.body_frame())
    X_TE = RigidTransform(R_SE, [0, 0, length])
    return plant.AddFrame(FixedOffsetFrame("grasp", body.body_frame(), X_TE, instance))


def draw(
    plant: MultibodyPlant, body: RigidBody, z: float, shape: Box | Cylinder, name: str, color: Array
) -> None:
    """Draws a shape with its middle at height z; without a SceneGraph it draws nothing."""
    if plant.geometry_source_is_registered():
        plant.RegisterVisualGeometry(body, RigidTransform([0, 0, z]), shape, name, color)
