"""Replaces impossible inertias in a robot's description by the nearest possible one, or refuses.

With I the rotational inertia about the centre of mass, a body has the second moments of mass
Σ = ½ tr(I) 1 − I. They are positive semidefinite. In other words, no principal moment is larger
than the sum of the other two.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np
from pydrake.multibody.tree import RotationalInertia

from geoimp_drake.errors import ModelError
from geoimp_drake.robot_files.description import Description
from geoimp_drake.robot_files.inertial_elements import (
    MOMENTS,
    inertials,
    read_inertial,
    write_inertial,
)
from geoimp_drake.robot_files.source import place_of
from geoimp_drake.typing import Array

__all__ = ["INERTIA", "InertiaFault", "refuse", "repair_inertias"]

# The ways to treat such an inertia of the arm's own moving links.
INERTIA = ("check", "repair")
# The error that rounding in files causes, as a fraction of the largest principal moment.
_ROUNDED = 0.01


@dataclass(frozen=True)
class InertiaFault:
    """An inertia that no body can have.

    Attributes:
        link: its name.
        off: by which fraction of itself the largest principal moment exceeds the sum of the others;
            infinite for inertia without mass.
        said: what is wrong and what can be done, in words.
    """

    link: str
    off: float
    said: str


def repair_inertias(description: Description) -> list[InertiaFault]:
    """Replaces impossible inertias by the nearest possible ones; massless links get none.

    Raises:
        ModelError: a mass is negative, or a number is not finite, so there is no nearest inertia.
    """
    faults = []
    for link, inertial in inertials(description):
        name = link.get("name", "without name")
        mass, moments = read_inertial(inertial, description.format)
        numbers = ", ".join(f"{n} {value:g}" for n, value in zip(MOMENTS, moments, strict=True))
        stated = f"Link '{name}' has mass {mass:g} kg and inertia {numbers} kg m²"
        if place := place_of(inertial):
            stated = f"{place}: {stated}"
        if not np.isfinite([mass, *moments]).all() or mass < 0:
            raise ModelError(f"{stated}: give finite numbers and a mass that is not negative.")
        if (fault := _fault(name, mass, moments, stated)) is not None:
            faults.append(fault)
            nearest = _nearest(moments) if mass > 0 else np.zeros(6)
            write_inertial(inertial, description.format, mass, nearest)
    if faults:
        described = ", ".join(
            f"{fault.link} ({f'{fault.off:.2%} off' if np.isfinite(fault.off) else 'no mass'})"
            for fault in faults
        )
        description.changes.append(f"inertias replaced by the nearest of a body: {described}")
    return faults


def refuse(faults: Iterable[InertiaFault], links: Collection[str]) -> None:
    """Raises ModelError for a fault of one of these links that exceeds rounding."""
    for fault in faults:
        if fault.link in links and fault.off > _ROUNDED:
            raise ModelError(fault.said)


def _fault(link: str, mass: float, moments: Array, stated: str) -> InertiaFault | None:
    todo = "Correct the file, or give inertia 'repair' to use the nearest that a body can have."
    if mass == 0:
        said = f"{stated}: without mass there is no inertia. Give its mass. {todo}"
        return InertiaFault(link, np.inf, said) if moments.any() else None
    if RotationalInertia(*moments).CouldBePhysicallyValid():
        return None
    principal = np.linalg.eigvalsh(_matrix(moments))
    excess = 2.0 * principal[2] - principal.sum()
    said = (
        f"{stated}, which no body can have: of the principal moments "
        f"{', '.join(f'{value:.4g}' for value in principal)}, none may be negative or larger "
        f"than the sum of the other two. {todo}"
    )
    return InertiaFault(link, float(excess / np.abs(principal).max()), said)


def _nearest(moments: Array) -> Array:
    """Returns the moments of the nearest Σ that is positive semidefinite."""
    I = _matrix(moments)  # noqa: E741  (the inertia's own letter)
    values, axes = np.linalg.eigh(0.5 * np.trace(I) * np.eye(3) - I)
    S = (axes * np.maximum(values, 0.0)) @ axes.T
    nearest = np.trace(S) * np.eye(3) - S
    return nearest[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


def _matrix(moments: Array) -> Array:
    xx, yy, zz, xy, xz, yz = moments
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
