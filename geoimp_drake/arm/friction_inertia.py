"""The inertia that viscous friction adds to a joint in a discrete plant's step."""

from pydrake.multibody.plant import DiscreteContactApproximation, MultibodyPlant
from pydrake.multibody.tree import Joint

from geoimp_drake.typing import Array

__all__ = ["friction_inertia"]


def friction_inertia(plant: MultibodyPlant, joint: Joint) -> Array:
    """Returns Δt F, one per velocity of a joint [kg m² or kg].

    A discrete plant evaluates friction at the end of a step, B (v⁺ − v)/Δt = τ − F v⁺ − …. It thus
    moves as if its inertia were B + Δt F. TAMSI evaluates friction at the beginning of the step.
    With TAMSI, and in a continuous plant, the result is zero.
    """
    # Newer Drakes have no TAMSI.
    tamsi = getattr(DiscreteContactApproximation, "kTamsi", None)
    explicit = plant.get_discrete_contact_approximation() == tamsi
    added: Array = (0.0 if explicit else plant.time_step()) * joint.default_damping_vector()
    return added
