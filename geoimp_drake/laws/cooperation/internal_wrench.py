"""The wrench with which two hands load the object and not its environment."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.typing import Array

__all__ = ["internal_wrench"]


@compilable
def internal_wrench(h_1: Array, h_2: Array) -> Array:
    """Returns ½(h_2 − h_1) (6,), [moment; force], each moment about its own hand, in W [Nm, N].

    It is the dual of the mutual velocity (4.9), as (4.6) is of (4.5): Σ h_kᵀv_k = h_oᵀv_o +
    h_iᵀΔv_21. Hands that squeeze the object push it towards each other: the internal force then
    points from the second hand to the first, against Δp_21. Moved to O, the moments would contain
    the bending of the object under its load.

    Args:
        h_1: wrench of the first hand on the object (6,), about its own origin, in W.
        h_2: the same of the second (6,).
    """
    return 0.5 * (h_2 - h_1)
