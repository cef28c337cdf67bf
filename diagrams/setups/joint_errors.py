"""What joints do that their controllers do not know: friction that falls, and coarse encoders."""

from collections.abc import Callable

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from geoimp_drake.systems.part_system import Block
from geoimp_drake.typing import Array

__all__ = ["VectorFunction", "fallen_friction", "rounded"]


def fallen_friction(v: Array, fall: Array, velocity: float) -> Array:
    """Returns what Stribeck friction is below that at rest, along the motion (n) [Nm or N].

    τ = fall (1 − exp(−(v/v_s)²)) sign(v)

    Args:
        v: of the joints (n,).
        fall: of the friction of each from rest to fast motion (n,).
        velocity: v_s, where 1/e of it is left to fall [rad/s, m/s].
    """
    return -fall * np.expm1(-((v / velocity) ** 2)) * np.sign(v)


def rounded(q: Array, step: float) -> Array:
    """Returns positions as an encoder of a resolution has them (n)."""
    return step * np.rint(q / step)


class VectorFunction(Block):
    """A function of a vector.

    Args:
        function: of the input.
        sizes: of its argument and its value, n each if there is one alone.

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
