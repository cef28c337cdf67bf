"""Something for a hand to run into: a mass on a rail, or clamped, whose surface is a spring."""

from dataclasses import dataclass, field

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import AddContactMaterial, Box, ProximityProperties, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import ContactResults, CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    PrismaticJoint,
    RigidBody,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from geoimp_drake.typing import Array
from geoimp_drake.validation import finite_vector, key, positive

__all__ = ["BALL_RADIUS", "CollidingBody", "ContactForce"]

BALL_RADIUS = 0.02  # of the touching ball, about E's origin [m]
_SIZE = np.array([0.8, 0.8, 0.1])  # of the body; its face is the first two [m]
_RIGID = 1e10  # of the ball [N/m]
_COLOUR = np.array([0.9, 0.7, 0.6, 1.0])


@dataclass
class CollidingBody:
    """A body whose face the hand runs into, without friction."""

    stiffness: float = 0.0  # of its surface; to be given [N/m]
    mass: float | None = None  # free to move along its normal; null if it is clamped [kg]
    point: Array = field(default_factory=lambda: np.zeros(3))  # of its face, in W [m]
    normal: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  # outward, in W

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        positive(self.stiffness, key(name, "stiffness"), "N/m")
        if self.mass is not None:
            positive(self.mass, key(name, "mass"), "kg")
        finite_vector(self.point, key(name, "point"), 3)
        finite_vector(self.normal, key(name, "normal"), 3)

    def add(self, plant: MultibodyPlant, hand: RigidBody, p_HE: Array) -> None:
        """Adds the body, and a ball about a point of the hand (3,) that touches it."""
        instance = plant.AddModelInstance("colliding_body")
        mass = 1.0 if self.mass is None else self.mass
        inertia = SpatialInertia(mass, np.zeros(3), UnitInertia.SolidBox(*_SIZE))
        body = plant.AddRigidBody("colliding_body", instance, inertia)
        plant.set_gravity_enabled(instance, False)
        rotation = RotationMatrix.MakeFromOneVector(np.asarray(self.normal, dtype=float), 2)
        X_WB = RigidTransform(rotation, np.asarray(self.point, dtype=float))
        if self.mass is None:
            plant.WeldFrames(plant.world_frame(), body.body_frame(), X_WB)
        else:
            rail = plant.AddFrame(FixedOffsetFrame("rail", plant.world_frame(), X_WB))
            plant.AddJoint(PrismaticJoint("rail", rail, body.body_frame(), [0.0, 0.0, 1.0]))
        X_BF = RigidTransform(np.array([0.0, 0.0, -0.5 * _SIZE[2]]))
        for owner, X, shape, stiffness in (
            (body, X_BF, Box(*_SIZE), self.stiffness),
            (hand, RigidTransform(p_HE), Sphere(BALL_RADIUS), _RIGID),
        ):
            name = f"{owner.name()}_touches"
            plant.RegisterCollisionGeometry(owner, X, shape, name, _elastic(stiffness))
        plant.RegisterVisualGeometry(body, X_BF, Box(*_SIZE), "colliding_body", _COLOUR)


class ContactForce(LeafSystem):
    """The size of the force between the ball and the body.

    Ports:
        input contact_results: of the plant, abstract
        output force: of its point contacts [N] (1)
    """

    def __init__(self) -> None:
        super().__init__()
        self._contacts = self.DeclareAbstractInputPort(
            "contact_results", AbstractValue.Make(ContactResults())
        )
        self.DeclareVectorOutputPort("force", 1, self._sum)

    def _sum(self, context: Context, value: BasicVector) -> None:
        contacts = self._contacts.Eval(context)
        force = np.zeros(3)
        for k in range(contacts.num_point_pair_contacts()):
            force += contacts.point_pair_contact_info(k).contact_force()
        value.SetAtIndex(0, float(np.linalg.norm(force)))


def _elastic(stiffness: float) -> ProximityProperties:
    """Returns the properties of a surface without dissipation and friction."""
    properties = ProximityProperties()
    AddContactMaterial(
        point_stiffness=stiffness, friction=CoulombFriction(0.0, 0.0), properties=properties
    )
    properties.AddProperty("material", "relaxation_time", 0.0)
    return properties
