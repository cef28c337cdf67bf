"""What two hands carry besides the contact."""

from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.typing import Array
from geoimp_drake.validation import (
    check,
    choice,
    finite_array,
    finite_vector,
    key,
    non_negative,
    symmetric,
)

__all__ = ["OBJECT_WRENCHES", "LoadArguments", "ObjectLoad"]

OBJECT_WRENCHES = ("grasp-matrix", "printed")


@dataclass
class ObjectLoad:
    """What the hands carry besides the contact; it is removed from the object's wrench.

    If a hand's wrench is already without the weight of some part of the object, leave out that part
    here.
    """

    mass: float = 0.0  # [kg]
    centre_of_mass: Array = field(default_factory=lambda: np.zeros(3))  # p_OG in O [m]
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))  # about G, in O [kg m²]
    inertial_load: str = "compliant"  # of C's motion, removed with the weight; none: weight alone

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        non_negative(self.mass, key(name, "mass"), "kg")
        finite_vector(self.centre_of_mass, key(name, "centre_of_mass"), 3)
        where = key(name, "inertia")
        inertia = symmetric(finite_array(self.inertia, where, (3, 3)), where)
        choice(self.inertial_load, key(name, "inertial_load"), ("compliant", "none"))
        smallest = float(np.linalg.eigvalsh(inertia)[0])
        if smallest < -1e-9:
            raise ConfigurationError(
                f"{where} is not the inertia of a body: it must have no negative eigenvalue; the "
                f"smallest is {smallest:.4g} kg m²."
            )


class LoadArguments:
    """How the object's wrench follows from those of the hands.

    Args:
        load: mass, centre of mass and inertia of the object; None for nothing.
        gravity: g in W (3) [m/s²]; by default the earth's.
        wrench: `grasp-matrix` or `printed`, as (4.6).

    Attributes:
        arguments: whether (4.6) is taken as printed; mass, p_OG and I about G in O; g in W.
        removes_inertial_load: whether that of C's motion is removed, besides the weight.

    Raises:
        ConfigurationError: a field of the load, the gravity or the wrench's name cannot be used.
    """

    def __init__(
        self,
        load: ObjectLoad | None = None,
        gravity: Array | None = None,
        wrench: str = "grasp-matrix",
    ):
        load = load or ObjectLoad()
        check(load, "load")
        choice(wrench, "object wrench", OBJECT_WRENCHES)
        earth = np.array([0.0, 0.0, -9.81])
        self.arguments = (
            wrench == "printed",
            float(load.mass),
            np.array(load.centre_of_mass, dtype=float),
            np.array(load.inertia, dtype=float, order="C"),
            finite_vector(earth if gravity is None else gravity, "gravity", 3),
        )
        self.removes_inertial_load = load.mass > 0 and load.inertial_load == "compliant"
