"""Errors of joints that their controllers do not know: Stribeck friction and coarse encoders."""

from collections.abc import Callable

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from geoimp_drake.systems.part_system import Block
from geoimp_drake.typing import Array

__all__ = ["VectorFunction", "fallen_friction", "rounded"]


def fallen_friction(v: Array, fall: Array, velocity: float) -> Array:
    """Returns by how much Stribeck friction is below that at rest, along the motion (n) [Nm or N].

    τ = fall (1 − exp(−(v/v_s)²)) sign(v)

    Args:
        v: velocities of the joints (n,).
        fall: decrease of each joint's friction from rest to fast motion (n,).
        velocity: v_s, at which 1/e of the decrease is still to come [rad/s, m/s].
    """
    return -fall * np.expm1(-((v / velocity) ** 2)) * np.sign(v)


def rounded(q: Array, step: float) -> Array:
    """Returns positions as an encoder with a resolution reads them (n)."""
    return step * np.rint(q / step)


class VectorFunction(Block):
    """A function of a vector.

    Args:
        function: of the input.
        sizes: of its argument and its value; a single one is that of both.

    Ports:
        input u: its argument (n)
        output y: its value (n)
    """

    def __init__(self, function: Callable[[Array], Array], *sizes: int):
        super().__init__()
        self._function = function
        self._input = self.DeclareVectorInputPort("u", sizes[0])
        self.DeclareVectorOutputPort("y", sizes[-1], self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._function(self._input.Eval(context)))
