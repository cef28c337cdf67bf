"""A peg, and a block with a blind hole for it, to be welded to the bodies that carry them.

             H: centre of the mouth, z out of the hole
    ┌────────┐ │ ┌────────┐
    │        │ ▼ │        │        peg: compliant hydroelastic, steel
    │        │peg│        │        block: rigid facets, wood; transparent
    │        └─┬─┘        │
    └──────────┼──────────┘
               P: centre of the tip, z out of the tip, against z_H when the peg arrives

Use a discrete plant with the SAP approximation: "lagged" creeps under friction and costs more. See
`geoimp_drake.diagrams.scene.insertion` for the pose of a peg in its hole.
"""

from pydrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    Cylinder,
    ProximityProperties,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import CalcSpatialInertia, Frame, RigidBody, SpatialInertia

from geoimp_drake.diagrams.scene.peg_hole_config import PegHoleConfig
from geoimp_drake.diagrams.scene.peg_hole_mesh import block_shape, hole_facets, peg_volume
from geoimp_drake.errors import ModelError
from geoimp_drake.validation import check

__all__ = ["PegHoleConfig", "add_block", "add_peg"]


def add_peg(
    plant: MultibodyPlant,
    frame: Frame,
    X_FP: RigidTransform,
    config: PegHoleConfig,
    name: str = "peg",
) -> RigidBody:
    """Adds a peg as a body and a model instance of its own, and welds it.

    Args:
        plant: a discrete MultibodyPlant, registered with a SceneGraph and not yet finalized.
        frame: F, to which the peg is welded.
        X_FP: of the peg in F; P at the centre of its tip face, z_P out of the tip.
        config: of peg and hole; validated here.
        name: of the body and of its model instance.

    Returns:
        The body; its frame is P.

    Raises:
        ConfigurationError: the configuration cannot be used.
        ModelError: the plant has no scene graph, is finalized, or has a model of that name.
    """
    check(config, "peg_hole")
    radius, length = config.peg_diameter / 2, config.peg_length
    X_PC = RigidTransform([0.0, 0.0, -length / 2])
    M_C = SpatialInertia.SolidCylinderWithDensity(config.peg_density, radius, length, [0, 0, 1])
    peg = _add_welded(plant, frame, X_FP, M_C.Shift(-X_PC.translation()), name)
    plant.RegisterVisualGeometry(peg, X_PC, Cylinder(radius, length), "peg", config.peg_color)
    properties = _material(config, config.relaxation_time, config.dissipation)
    # Drake uses a mesh of tetrahedra as it is: it needs no resolution hint.
    AddCompliantHydroelasticProperties(
        hydroelastic_modulus=config.modulus, properties=properties, resolution_hint=radius
    )
    plant.RegisterCollisionGeometry(peg, RigidTransform(), peg_volume(config), "peg", properties)
    return peg


def add_block(
    plant: MultibodyPlant,
    frame: Frame,
    X_FH: RigidTransform,
    config: PegHoleConfig,
    name: str = "block",
) -> RigidBody:
    """Adds a block with a hole as a body and a model instance of its own, and welds it.

    Only its front and the inside of its hole take part in contact.

    Args:
        plant: a discrete MultibodyPlant, registered with a SceneGraph and not yet finalized.
        frame: F, to which the block is welded.
        X_FH: of the hole in F; H at the centre of its mouth, z_H out of the hole.
        config: of peg and hole; validated here.
        name: of the body and of its model instance.

    Returns:
        The body; its frame is H.

    Raises:
        ConfigurationError: the configuration cannot be used.
        ModelError: the plant has no scene graph, is finalized, or has a model of that name.
    """
    check(config, "peg_hole")
    shape, X_HH = block_shape(config), RigidTransform()
    M_H = CalcSpatialInertia(shape, config.block_density)
    block = _add_welded(plant, frame, X_FH, M_H, name)
    plant.RegisterVisualGeometry(block, X_HH, shape, "block", config.block_color)
    # Drake adds the relaxation times of both sides: the peg has all of it.
    properties = _material(config, 0.0, 0.0)
    AddRigidHydroelasticProperties(properties)
    for facet, mesh in hole_facets(config).items():
        plant.RegisterCollisionGeometry(block, X_HH, mesh, facet, properties)
    return block


def _add_welded(
    plant: MultibodyPlant, frame: Frame, X_FB: RigidTransform, M_B: SpatialInertia, name: str
) -> RigidBody:
    """Adds a body B of the inertia M_BBo_B."""
    _check_plant(plant, name)
    body = plant.AddRigidBody(name, plant.AddModelInstance(name), M_B)
    plant.WeldFrames(frame, body.body_frame(), X_FB)
    return body


def _material(
    config: PegHoleConfig, relaxation_time: float, dissipation: float
) -> ProximityProperties:
    properties = ProximityProperties()
    friction = CoulombFriction(config.friction, config.friction)
    AddContactMaterial(dissipation=dissipation, friction=friction, properties=properties)
    properties.AddProperty("material", "relaxation_time", relaxation_time)
    return properties


def _check_plant(plant: MultibodyPlant, name: str) -> None:
    if not plant.geometry_source_is_registered():
        raise ModelError(f"{name!r} needs geometry: register the plant with a SceneGraph first.")
    if plant.time_step() == 0:
        raise ModelError("the plant is continuous: give it a time step, such as 1e-3 s.")
    if plant.is_finalized():
        raise ModelError(f"{name!r} comes too late: add it before the plant's Finalize().")
    if plant.HasModelInstanceNamed(name):
        raise ModelError(f"the plant has a model {name!r} already: give this one another name.")
