"""Further quantities of an arm's dynamics, for redundancy: Ḃ and the Coriolis forces."""

from pydrake.systems.framework import Context

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.typing import Array

__all__ = ["coriolis_forces", "inertia_rate"]

# Half the time between the two postures [s]. At 1 rad/s it leaves an error in Ḃ of 1e-10 of B per
# second, from truncation and from rounding alike.
_HALF_STEP = 1e-5


def inertia_rate(model: ControlModel, scratch: Context, q: Array, v: Array) -> Array:
    """Returns Ḃ (n, n), the derivative of the inertia matrix along q̇ = v.

    It is a central difference along v: two evaluations of B. Leaves `scratch` at q.

    Args:
        model: the arm.
        scratch: a context of the model's plant.
        q: joint positions (n,), in the order of the model.
        v: joint velocities (n,).
    """
    plant = model.plant
    dq = v * _HALF_STEP
    plant.SetPositions(scratch, q + dq)
    B_after = plant.CalcMassMatrix(scratch)
    plant.SetPositions(scratch, q - dq)
    B_before = plant.CalcMassMatrix(scratch)
    plant.SetPositions(scratch, q)
    return (B_after - B_before) / (2.0 * _HALF_STEP)


def coriolis_forces(model: ControlModel, scratch: Context, v: Array) -> Array:
    """Returns c(q, v) = C(q, v)v (n,) [Nm or N] at the posture of `scratch`."""
    model.plant.SetVelocities(scratch, v)
    return model.plant.CalcBiasTerm(scratch)
