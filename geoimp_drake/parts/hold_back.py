"""The compliant frame, held back by what the limits leave undone."""

import numpy as np

from geoimp_drake.laws.limits.held_back import held_back
from geoimp_drake.parts.part import Memory
from geoimp_drake.typing import Array

__all__ = ["NO_SLACK", "HoldBack"]

NO_SLACK = np.zeros(6)

# Energy in the tank from which holding C back takes: at the start, and at most [J].
_TANK, _CAP = 0.2, 2.0

# After a longer pause no limit has acted, and the tank stays as it is [s].
_LONGEST_STEP = 0.01


class HoldBack:
    """(L.3) The acceleration of C besides that of its law, and the tank from which it takes energy.

    It is a piece of `Impedance`. Damping fills the tank while a limit acts.

    Args:
        parts: whether rotation and translation are compliant; what is not follows D.
    """

    def __init__(self, parts: tuple[bool, bool]):
        self._parts = np.repeat(np.array(parts, dtype=float), 3)
        self.memory = Memory(slack=NO_SLACK, holds=0.0, tank=_TANK, time=-_LONGEST_STEP)

    def keep(
        self, memory: Array, slack: Array, velocity: Array, M: Array, gained: float, time: float
    ) -> None:
        """Keeps what holds C back from now on.

        Args:
            memory: of this object, updated.
            slack: acceleration of E that the limits leave undone (6,).
            velocity: of C (6,).
            M: mass matrix of the impedance, in W (6, 6).
            gained: power that its damping dissipates [W].
            time: [s].
        """
        places, step = self.memory, time - memory[self.memory.time]
        memory[places.slack], memory[places.tank] = held_back(
            self._parts * slack,
            velocity,
            M,
            gained,
            memory[places.tank],
            _CAP,
            step if step < _LONGEST_STEP else 0.0,
        )
        memory[places.holds] = memory[places.slack].any()
        memory[places.time] = time
