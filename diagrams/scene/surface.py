"""Surfaces to feel, and the rigid disk that feels them.

A compliant hydroelastic layer of stiffness k_h [N/m] under a disk of radius r resists tilt with no
more than k_h r²/4. To reach both stiffnesses of a real sheet, normal and tilt, the layer is in
series with a compliant mount. The layer is the front of a plate that a bushing holds.

       disk ▽          S: origin at the expected contact, z along the outward normal
    ───────S───────    layer (k_h): the front half of the plate
    ═══════╤═══════    plate: a free body without weight
           M           mount: a bushing, centred at the pivot and parallel to S
    ───────┴───────    world

Use a discrete plant with the SAP approximation: "lagged" lets the contact creep sideways.
"""

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    Box,
    GeometryId,
    Mesh,
    ProximityProperties,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    LinearBushingRollPitchYaw,
    ModelInstanceIndex,
    RigidBody,
    SpatialInertia,
)

from geoimp_drake.diagrams.scene.polyhedra import Polyhedra, regular_polygon
from geoimp_drake.diagrams.scene.surface_config import (
    DISK_RADIUS,
    SURFACES,
    SurfaceConfig,
    cardboard,
    disk_sides,
    plexiglas,
    stiff_plexiglas,
)
from geoimp_drake.diagrams.scene.surface_looks import APPEARANCES, draw_stand
from geoimp_drake.errors import ModelError
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, non_negative, positive

__all__ = [
    "DISK_RADIUS",
    "SURFACES",
    "SurfaceConfig",
    "SurfaceHandles",
    "add_disk_contact",
    "add_surface",
    "cardboard",
    "plexiglas",
    "stiff_plexiglas",
    "surface_plane",
]


@dataclass
class SurfaceHandles:
    """The parts that `add_surface` put into the plant."""

    model_instance: ModelInstanceIndex
    body: RigidBody  # the plate; its frame is S
    geometry: GeometryId  # the layer's, for contact results
    mount: LinearBushingRollPitchYaw  # its stiffness can be changed in a context
    X_WS: RigidTransform  # of the undeformed surface


def surface_plane(X_WS: RigidTransform) -> Array:
    """Returns the undeformed surface as [n_W, offset], shape (4,), with n·x = offset on it."""
    n_W = X_WS.rotation().col(2)
    return np.append(n_W, n_W @ X_WS.translation())


def add_surface(
    plant: MultibodyPlant,
    config: SurfaceConfig,
    X_WS: RigidTransform,
    *,
    pivot: Array | None = None,
) -> SurfaceHandles:
    """Adds the plate, its layer and its mount as a model instance of their own.

    Args:
        plant: a discrete MultibodyPlant, registered with a SceneGraph and not yet finalized.
        config: of the surface; validated here.
        X_WS: pose of the undeformed surface; z outward, origin at the expected contact.
        pivot: p_SM [m], the mount's centre in S; the origin of S unless given. The farther it is
            from the contact, the softer the surface feels: the plate turns under a normal force.

    Raises:
        ConfigurationError: the configuration cannot be used, or not with the plant's time step.
        ModelError: the plant has no scene graph, is finalized, or has a model of that name.
    """
    check(config, "surface")
    _check_plant(plant, config.name)
    config.check_step("surface", plant.time_step())
    instance = plant.AddModelInstance(config.name)
    plate = plant.AddRigidBody("plate", instance, _plate_inertia(config))
    plant.set_gravity_enabled(instance, False)
    plant.SetDefaultFloatingBaseBodyPose(plate, X_WS)
    geometry = plant.RegisterCollisionGeometry(
        plate, _plate_pose(config), Box(*config.size), "layer", _layer_properties(config)
    )
    X_SM = RigidTransform(np.zeros(3) if pivot is None else np.asarray(pivot, dtype=float))
    mount = _add_mount(plant, config, plate, X_WS, X_SM)
    X_SF = RigidTransform(np.append(config.centre, 0.0))
    APPEARANCES[config.appearance](plant, plate, X_SF, config.size, config.color)
    if config.stand:
        draw_stand(plant, config.name, X_WS @ X_SF, config.size[2])
    return SurfaceHandles(instance, plate, geometry, mount, X_WS)


def add_disk_contact(
    plant: MultibodyPlant,
    body: RigidBody,
    X_BD: RigidTransform,
    *,
    friction: float,
    radius: float = DISK_RADIUS,
    thickness: float = 0.01,
    resolution_hint: float = 0.05,
) -> GeometryId:
    """Gives `body` the collision geometry of a rigid disk.

    Args:
        plant: registered with a SceneGraph and not yet finalized.
        body: the one that carries the disk.
        X_BD: origin at the centre of the disk's front face, z out of the disk.
        friction: Coulomb's μ [-]. Drake takes the harmonic mean with the surface's; give the same
            number.
        radius: [m].
        thickness: [m].
        resolution_hint: [m] greatest length of the disk's edges. At 0.05 the disk is a heptagon;
            the surfaces are calibrated for it, and finer disks feel stiffer and cost more.

    Raises:
        ConfigurationError: a number cannot be used.
    """
    non_negative(friction, "disk.friction")
    positive(thickness, "disk.thickness", "m")
    sides = disk_sides(resolution_hint, "disk.mesh", radius)
    properties = ProximityProperties()
    AddRigidHydroelasticProperties(resolution_hint, properties)
    AddContactMaterial(friction=CoulombFriction(friction, friction), properties=properties)
    # Drake adds the relaxation times of both sides; its default would drown the layer's.
    properties.AddProperty("material", "relaxation_time", 0.0)
    return plant.RegisterCollisionGeometry(
        body, X_BD, _flat_cone(radius, thickness, sides), "disk", properties
    )


def _flat_cone(radius: float, height: float, n: int) -> Mesh:
    """Returns a disk for contact: a polygon of n sides at z = 0, and a point behind it.

    The sides of a cylinder sink into the surface, and each makes faces there that carry nothing.
    The sides of a cone face away from the surface, and Drake leaves them out.
    """
    middle, point = n, n + 1
    i, j = np.arange(n), (np.arange(n) + 1) % n
    front = np.column_stack([np.full(n, middle), i, j])
    sides = np.column_stack([np.full(n, point), j, i])
    vertices = [*regular_polygon(n, radius, 0.0), np.zeros(3), np.array([0.0, 0.0, -height])]
    return Polyhedra(np.array(vertices), np.vstack([front, sides])).triangles("disk")


def _plate_pose(config: SurfaceConfig) -> RigidTransform:
    """X_SC of the plate's middle: the front face lies in the plane z = 0 of S."""
    return RigidTransform(np.append(config.centre, -config.size[2] / 2))


def _plate_inertia(config: SurfaceConfig) -> SpatialInertia:
    """A box's, with its mass behind S wherever the plate is: a push there should not turn it."""
    M_PCo = SpatialInertia.SolidBoxWithMass(config.plate_mass, *config.size)
    return M_PCo.Shift(np.array([0.0, 0.0, config.size[2] / 2]))


def _layer_properties(config: SurfaceConfig) -> ProximityProperties:
    # The pressure grows linearly from the face to the plate's middle: k_h = modulus · πr² / (h/2).
    modulus = config.layer_stiffness * (config.size[2] / 2) / (np.pi * DISK_RADIUS**2)
    properties = ProximityProperties()
    AddCompliantHydroelasticProperties(config.resolution_hint, modulus, properties)
    friction = CoulombFriction(config.friction, config.friction)
    AddContactMaterial(friction=friction, properties=properties)
    properties.AddProperty("material", "relaxation_time", float(config.relaxation_time))
    return properties


def _add_mount(
    plant: MultibodyPlant,
    config: SurfaceConfig,
    plate: RigidBody,
    X_WS: RigidTransform,
    X_SM: RigidTransform,
) -> LinearBushingRollPitchYaw:
    """The bushing's two frames coincide at rest: its angles stay far from their singularity."""
    instance = plate.model_instance()
    frames = (
        FixedOffsetFrame(f"{config.name}_mount", plant.world_frame(), X_WS @ X_SM, instance),
        FixedOffsetFrame(f"{config.name}_plate", plate.body_frame(), X_SM, instance),
    )
    return plant.AddForceElement(
        LinearBushingRollPitchYaw(
            *(plant.AddFrame(frame) for frame in frames),
            np.full(3, config.mount_tilt_stiffness),
            np.full(3, config.mount_tilt_damping),
            np.full(3, config.mount_stiffness),
            np.full(3, config.mount_damping),
        )
    )


def _check_plant(plant: MultibodyPlant, name: str) -> None:
    if not plant.geometry_source_is_registered():
        raise ModelError("a surface needs geometry: register the plant with a SceneGraph first.")
    if plant.time_step() == 0:
        raise ModelError("the plant is continuous: give it a time step, such as 1e-3 s.")
    if plant.is_finalized():
        raise ModelError(f"surface {name!r} comes too late: add it before the plant's Finalize().")
    if plant.HasModelInstanceNamed(name):
        raise ModelError(f"the plant has a model {name!r} already: give the surface another name.")
