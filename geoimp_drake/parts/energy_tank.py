"""A tank for the energy that changing gains put into a spring."""

from dataclasses import dataclass

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.passivity.energy_tank import taken_from_tank
from geoimp_drake.parts.part import Memory
from geoimp_drake.typing import Array
from geoimp_drake.validation import key, non_negative, positive

__all__ = ["EnergyTank", "TankConfig"]


@dataclass
class TankConfig:
    """How much energy changing gains may give out beyond what the spring had stored."""

    start: float = 0.2  # energy in the tank at the start [J]
    cap: float = 2.0  # the most that it holds; damping fills it [J]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        non_negative(self.start, key(name, "start"), "J")
        positive(self.cap, key(name, "cap"), "J")
        if self.start > self.cap:
            raise ConfigurationError(
                f"{key(name, 'start')} is {self.start:g} J, more than the {self.cap:g} J of "
                f"{key(name, 'cap')} that the tank holds. Give at most that."
            )


class EnergyTank:
    """A tank from which changes of a stiffness take energy (L.4); it is a piece of other parts.

    Args:
        config: what it holds at the start, and at most.
    """

    def __init__(self, config: TankConfig):
        self._cap = config.cap
        self.memory = Memory(level=config.start)

    def share(self, memory: Array, injected: float, gained: float) -> float:
        """Returns the share of a change that takes place, and takes its energy from the tank.

        Args:
            memory: of this object, updated.
            injected: what the whole change puts into the spring [J].
            gained: what damping has dissipated since the last call [J].
        """
        level = float(memory[self.memory.level])
        share, memory[self.memory.level] = taken_from_tank(injected, gained, level, self._cap)
        return share
