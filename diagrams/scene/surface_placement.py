"""The place of a surface in a scenario, and a check that a disk is clear of it."""

from dataclasses import dataclass, field

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from geoimp_drake.diagrams.scene.surface import (
    DISK_RADIUS,
    SurfaceConfig,
    add_disk_contact,
    add_surface,
)
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.typing import Array
from geoimp_drake.validation import finite_vector, key

__all__ = ["SurfacePlacement", "check_clear"]


@dataclass
class SurfacePlacement:
    """A surface and its place."""

    point: Array = field(default_factory=lambda: np.array([0.9, 0.0, 0.52]))  # in W [m]
    normal: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  # outward, in W
    properties: SurfaceConfig = field(default_factory=SurfaceConfig)

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        finite_vector(self.point, key(name, "point"), 3)
        normal = finite_vector(self.normal, key(name, "normal"), 3)
        if np.linalg.norm(normal) < 1e-6:
            raise ConfigurationError(
                f"{key(name, 'normal')} is zero; give the direction out of the surface."
            )

    def check_step(self, name: str, step: float) -> None:
        """Raises ConfigurationError if the surface diverges at a plant's time step [s]."""
        self.properties.check_step(key(name, "properties"), step)

    def add(
        self, plant: MultibodyPlant, body: RigidBody, X_BD: RigidTransform, disk_resolution: float
    ) -> None:
        """Adds the surface, and contact geometry to a body's disk.

        Args:
            plant: not finalized.
            body: the one with the disk.
            X_BD: pose of the disk on it.
            disk_resolution: edge length of the disk's contact mesh [m].
        """
        friction = self.properties.friction
        add_surface(plant, self.properties, self.pose())
        add_disk_contact(plant, body, X_BD, friction=friction, resolution_hint=disk_resolution)

    def resistance(self) -> tuple[Array, Array]:
        """Returns K_e and D_e (6×6) in W, [rotation; translation]: along the normal, no tilt."""
        normal = np.concatenate((np.zeros(3), self.pose().rotation().matrix()[:, 2]))
        along = np.outer(normal, normal)
        surface = self.properties
        return surface.normal_stiffness() * along, surface.normal_damping() * along

    def pose(self) -> RigidTransform:
        """Returns X_WS: z along the normal, origin at the point."""
        z = np.asarray(self.normal, dtype=float)
        return RigidTransform(RotationMatrix.MakeFromOneVector(z, 2), self.point)


def check_clear(
    X_WD: RigidTransform, plane: Array, start: str, radius: float = DISK_RADIUS
) -> None:
    """Raises ConfigurationError if a disk at X_WD reaches into the surface.

    `start` is the key that would move the disk.
    """
    n, offset = plane[:3], plane[3]
    tilt = n @ X_WD.rotation().matrix()[:, 2]
    lowest = n @ X_WD.translation() - offset - radius * np.sqrt(max(0.0, 1.0 - tilt * tilt))
    if lowest < 0:
        raise ConfigurationError(
            f"The disk starts {-lowest * 1e3:.1f} mm inside the surface; move {start} away "
            f"from it or surface.point back by at least that much."
        )
