"""Names that systems get in a user's diagram: Drake ends the process if two are equal."""

from collections import Counter
from collections.abc import Sequence
from weakref import WeakKeyDictionary

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import DiagramBuilder

__all__ = ["name_after_arms", "unused_name"]

# How often each name was given to a controller of a plant's arms.
_given: WeakKeyDictionary[MultibodyPlant, Counter[str]] = WeakKeyDictionary()


def unused_name(builder: DiagramBuilder, name: str) -> str:
    """Returns a name that no system of a diagram has: the name itself, or with a number from 2."""
    number, unused = 1, name
    while builder.HasSubsystemNamed(unused):
        number += 1
        unused = f"{name}_{number}"
    return unused


def name_after_arms(plant: MultibodyPlant, arms: Sequence[ModelInstanceIndex], what: str) -> str:
    """Returns a name for a controller that is added to a diagram later: the arms, and its kind.

    A further one of the same kind for the same arms of a plant gets a number from 2.

    Args:
        plant: contains the arms.
        arms: their model instances.
        what: the kind of controller.
    """
    name = "_".join([*(plant.GetModelInstanceName(arm) for arm in arms), what])
    given = _given.setdefault(plant, Counter())
    given[name] += 1
    return name if given[name] == 1 else f"{name}_{given[name]}"
