"""What keeps the impedance of a whole controller passive: none of it unless it is configured."""

from dataclasses import dataclass

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.energy_tank import TankConfig
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.part import Memory, Now, Output, held, nested
from geoimp_drake.parts.passive_gains import PassiveGains
from geoimp_drake.parts.within import Within
from geoimp_drake.typing import Array

__all__ = ["Passivity", "PassivityConfig"]


@dataclass
class PassivityConfig:
    """What keeps an impedance passive whose gains change."""

    gains: TankConfig | None = None  # K and D as signals, through a tank; null: a factor of K alone

    @property
    def is_on(self) -> bool:
        """Whether anything is asked for."""
        return self.gains is not None

    def refuse(self, name: str, why: str) -> None:
        """Raises ConfigurationError if anything is asked for; `why` says of what it is no part."""
        if self.is_on:
            raise ConfigurationError(f"{name}.gains is given, but {why}. Leave it out.")

    def make(self, springs: Impedance) -> "Passivity":
        """Returns the piece for an impedance."""
        return Passivity(None if self.gains is None else PassiveGains(springs, self.gains))


class Passivity:
    """A piece of whole controllers.

    Attributes:
        gains: the part that changes them; None if they do not change.
        inputs: of the controller, that change the gains, with their sizes.
    """

    def __init__(self, gains: PassiveGains | None = None):
        self.gains = gains
        self.memory = Memory(gains=Memory() if gains is None else gains.memory)
        self.inputs = {"stiffness_scale": 2} if gains is None else dict(gains.changing)

    def outputs(self, place: slice) -> list[Output]:
        """Returns the outputs; `place` is that of this piece's memory in the whole."""
        if self.gains is None:
            return []
        return [held("tank", nested(place, self.memory.gains, self.gains.level))]

    def start(self, memory: Array, now: Now) -> None:
        """Takes the gains as they are asked for."""
        if self.gains is not None:
            self.gains.start(memory[self.memory.gains], now)

    def keep(self, memory: Array, now: Now, C: Array) -> None:
        """Changes the gains for the step that begins.

        Args:
            memory: of this piece, moved on.
            now: the inputs of the controller.
            C: motion of C (19,).
        """
        if self.gains is not None:
            self.gains.keep(memory[self.memory.gains], now, C)

    def view(self, memory: Array, now: Now) -> Now:
        """Returns what the impedance sees: the gains as they have been granted.

        Args:
            memory: of this piece.
            now: the inputs of the controller.
        """
        if self.gains is None:
            return now
        given = self.gains.granted(memory[self.memory.gains], now)
        return Within(now, {}, given, now.memory, now.state)
