"""The families of rotational impedances by name, behind one interface."""

from collections.abc import Callable
from functools import partial

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.impedance.euler_families import (
    AlternativeEulerImpedance,
    ClassicalEulerImpedance,
)
from geoimp_drake.laws.impedance.geometric_families import AngleAxisImpedance, QuaternionImpedance
from geoimp_drake.laws.impedance.orientation_impedance import OrientationImpedance
from geoimp_drake.rotations.angle_axis import REPRESENTATIONS
from geoimp_drake.typing import Array

__all__ = [
    "FAMILIES",
    "AlternativeEulerImpedance",
    "AngleAxisImpedance",
    "ClassicalEulerImpedance",
    "OrientationImpedance",
    "QuaternionImpedance",
    "make_family",
]

FAMILIES: dict[str, Callable[[Array, Array, Array], OrientationImpedance]] = {
    "quaternion": QuaternionImpedance,
    "classical-euler": ClassicalEulerImpedance,
    "alternative-euler": AlternativeEulerImpedance,
    **{
        f"angle-axis-{row.name}": partial(AngleAxisImpedance, row)
        for row in REPRESENTATIONS.values()
    },
}


def make_family(name: str, M_o: Array, D_o: Array, K_o: Array) -> OrientationImpedance:
    """The rotational impedance called `name`, with parameters in the order of (3.22).

    Raises:
        ConfigurationError: there is no such family; the message lists the names.
    """
    if name not in FAMILIES:
        names = ", ".join(FAMILIES)
        raise ConfigurationError(f"no orientation family is called {name!r}: use one of {names}.")
    return FAMILIES[name](M_o, D_o, K_o)
