"""A wooden bar with a stick and a disk at its middle, and the grasps by which two hands hold it.

```
   S ═ rod ═ E_1 ═══════════ O ═══════════ E_2 ═ rod ═ S      y ─▶
                             ║ stick
                           ──D── disk, looking down
```

The bar is welded to one hand. The other holds it through a stiff bushing, or rigidly by a weld
constraint. The bushing models the flexibility of a real grasp, and can be opened in a Context.

Frames: O is in the middle of the bar, y along it. E_k are at its ends, parallel to O. D is at the
disk's centre, z out of it. S is a hand's mounting face behind the wrist sensor.
"""

from dataclasses import dataclass, field

import numpy as np
from pydrake.geometry import Box, Cylinder
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    LinearBushingRollPitchYaw,
    RigidBody,
    SpatialInertia,
)
from pydrake.systems.framework import Context

from geoimp_drake.diagrams.scene.rod import STEEL, draw
from geoimp_drake.diagrams.scene.surface import DISK_RADIUS
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.models.robot_data import TOOL
from geoimp_drake.models.urdf import inertia_of
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, choice, finite_vector, key, non_negative, positive

__all__ = [
    "BAR",
    "BarConfig",
    "GraspConfig",
    "add_bar",
    "add_grasp",
    "open_grasp",
]

BAR = "bar"  # name of the model instance, and of its body

_WOOD = np.array([0.76, 0.56, 0.34, 1.0])


@dataclass
class BarConfig:
    """The object: bar, stick and disk."""

    length: float = 1.0  # between the grasps [m]
    width: float = 0.05  # across [m]
    height: float = 0.04  # [m]
    stick: float = 0.15  # from the bar's axis to the disk's front face [m]
    friction: float = 0.3  # of the disk

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        for part in ("length", "width", "height"):
            positive(getattr(self, part), key(name, part), "m")
        shortest = self.height / 2 + TOOL.disk_thickness
        if not (np.isfinite(self.stick) and self.stick > shortest):
            raise ConfigurationError(
                f"{key(name, 'stick')} is {self.stick:g} m; bar and disk alone reach "
                f"{shortest:g} m."
            )
        non_negative(self.friction, key(name, "friction"))


@dataclass
class GraspConfig:
    """How the second hand holds the bar."""

    kind: str = "bushing"  # or rigid: a weld constraint, for a plant with SAP
    force_stiffness: float = 5e4  # of the bushing [N/m]
    force_damping: float = 100.0  # [Ns/m]
    torque_stiffness: float = 300.0  # [Nm/rad]
    torque_damping: float = 0.5  # [Nms/rad]
    squeeze: Array = field(default_factory=lambda: np.zeros(3))  # force on the bar at rest, W [N]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        choice(self.kind, key(name, "kind"), ("bushing", "rigid"))
        for part in ("force_stiffness", "force_damping", "torque_stiffness", "torque_damping"):
            positive(getattr(self, part), key(name, part))
        finite_vector(self.squeeze, key(name, "squeeze"), 3)
        if self.kind == "rigid" and np.any(self.squeeze):
            raise ConfigurationError(
                f"{key(name, 'squeeze')} is a preload of the bushing; with {key(name, 'kind')} "
                f"'rigid' leave it zero."
            )


def add_bar(plant: MultibodyPlant, config: BarConfig) -> RigidBody:
    """Adds the bar with stick and disk, which nothing holds yet; its frame is O.

    The frames `end_1`, `end_2` (at −y and +y) and `disk` are in the same model instance.
    """
    check(config, "bar")
    instance = plant.AddModelInstance(BAR)
    stick = config.stick - TOOL.disk_thickness
    shapes = (
        ("bar", Box(config.width, config.length, config.height), TOOL.wood_density, 0.0, _WOOD),
        ("stick", Cylinder(TOOL.stick_radius, stick), TOOL.steel_density, -stick / 2, STEEL),
        (
            "disk",
            Cylinder(DISK_RADIUS, TOOL.disk_thickness),
            TOOL.wood_density,
            TOOL.disk_thickness / 2 - config.stick,
            _WOOD,
        ),
    )
    solids = [(_inertia(shape, density), (0.0, 0.0, z)) for _, shape, density, z, _ in shapes]
    body = plant.AddRigidBody(BAR, instance, inertia_of(solids))
    for name, shape, _, z, colour in shapes:
        draw(plant, body, z, shape, name, colour)
    half = config.length / 2
    down = RotationMatrix.MakeXRotation(np.pi)
    for name, X_OF in (
        ("end_1", RigidTransform([0, -half, 0])),
        ("end_2", RigidTransform([0, half, 0])),
        ("disk", RigidTransform(down, [0, 0, -config.stick])),
    ):
        plant.AddFrame(FixedOffsetFrame(name, body.body_frame(), X_OF, instance))
    return body


def add_grasp(
    plant: MultibodyPlant, hand: Frame, end: Frame, config: GraspConfig
) -> LinearBushingRollPitchYaw | None:
    """Lets a hand hold an end of the bar; both frames coincide and are parallel to W at the start.

    The bushing bears half of the bar's weight there, so that neither hand pulls at the other.

    Returns:
        The bushing; None for the rigid grasp.
    """
    check(config, "grasp")
    if config.kind == "rigid":
        plant.AddWeldConstraint(
            hand.body(), hand.GetFixedPoseInBodyFrame(), end.body(), end.GetFixedPoseInBodyFrame()
        )
        return None
    weight = -end.body().default_mass() * plant.gravity_field().gravity_vector()
    stretch = (weight / 2 + np.asarray(config.squeeze)) / config.force_stiffness
    anchor = plant.AddFrame(FixedOffsetFrame("anchor", hand, RigidTransform(stretch)))
    return plant.AddForceElement(
        LinearBushingRollPitchYaw(
            anchor,
            end,
            np.full(3, config.torque_stiffness),
            np.full(3, config.torque_damping),
            np.full(3, config.force_stiffness),
            np.full(3, config.force_damping),
        )
    )


def open_grasp(bushing: LinearBushingRollPitchYaw, plant_context: Context) -> None:
    """Opens a grasp in a plant's context: the bushing then transmits nothing."""
    for set_zero in (
        bushing.SetTorqueStiffnessConstants,
        bushing.SetTorqueDampingConstants,
        bushing.SetForceStiffnessConstants,
        bushing.SetForceDampingConstants,
    ):
        set_zero(plant_context, np.zeros(3))


def _inertia(shape: Box | Cylinder, density: float) -> SpatialInertia:
    if isinstance(shape, Box):
        return SpatialInertia.SolidBoxWithDensity(density, *shape.size())
    return SpatialInertia.SolidCylinderWithDensity(
        density, shape.radius(), shape.length(), (0.0, 0.0, 1.0)
    )
