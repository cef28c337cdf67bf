"""What keeps the impedance of a whole controller passive: nothing unless it is configured."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.adaptive_damping import AdaptiveDamping, AdaptiveDampingConfig
from geoimp_drake.parts.energy_tank import TankConfig
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.part import Memory, Now, Output, held, nested
from geoimp_drake.parts.passive_gains import PassiveGains
from geoimp_drake.parts.within import Within
from geoimp_drake.typing import Array

__all__ = ["Passivity", "PassivityConfig"]


@dataclass
class PassivityConfig:
    """What keeps an impedance passive when its gains change or its contact rings."""

    gains: TankConfig | None = None  # K and D as signals, through a tank; null: factors of K alone
    damping: AdaptiveDampingConfig | None = None  # D rises while a contact rings; null: never

    @property
    def is_on(self) -> bool:
        """Whether anything is configured."""
        return self.gains is not None or self.damping is not None

    def refuse(self, name: str, why: str) -> None:
        """Raises ConfigurationError if anything is configured; `why` says why it cannot be used."""
        for field in ("gains", "damping"):
            if getattr(self, field) is not None:
                raise ConfigurationError(f"{name}.{field} is given, but {why}. Leave it out.")

    def make(self, springs: Impedance, period: float) -> "Passivity":
        """Returns the piece for an impedance whose readings have a period [s]."""
        return Passivity(
            None if self.gains is None else PassiveGains(springs, self.gains),
            None if self.damping is None else AdaptiveDamping(period, self.damping),
        )


class Passivity:
    """What whole controllers pass their gains through; a piece of them.

    Args:
        gains: the part that changes them through a tank; None if they pass unchanged.
        damping: the part that raises it; None if nothing does.

    Attributes:
        gains: as given.
        damping: as given.
        inputs: those of the controller that change the gains, with their sizes.
        changes_gains: whether the impedance sees other gains than those of the inputs.
    """

    def __init__(self, gains: PassiveGains | None = None, damping: AdaptiveDamping | None = None):
        self.gains, self.damping = gains, damping
        self.changes_gains = gains is not None or damping is not None
        self.memory = Memory(
            gains=Memory() if gains is None else gains.memory,
            damping=Memory() if damping is None else damping.memory,
        )
        self.inputs = {"stiffness_scale": 2} if gains is None else dict(gains.changing)

    def outputs(self, place: slice) -> list[Output]:
        """Returns the outputs; `place` is that of this piece's memory in the whole."""
        outputs = []
        if self.gains is not None:
            outputs.append(held("tank", nested(place, self.memory.gains, self.gains.level)))
        if self.damping is not None:
            inner = nested(place, self.memory.damping)
            outputs += [_moved(output, inner) for output in self.damping.outputs]
        return outputs

    def start(self, memory: Array, now: Now) -> None:
        """Takes the requested gains."""
        if self.gains is not None:
            self.gains.start(memory[self.memory.gains], now)

    def keep(
        self, memory: Array, now: Now, C: Array, measured: Callable[[], tuple[Array, Array]]
    ) -> None:
        """Changes the gains for the step that begins.

        Args:
            memory: of this piece, updated.
            now: the inputs of the controller.
            C: motion of C (19,).
            measured: returns the last measured wrench (6,) and motion of E (19,).
        """
        if self.gains is not None:
            self.gains.keep(memory[self.memory.gains], now, C)
        if self.damping is not None:
            names = {"measured_motion": "estimated_state"}
            self.damping.keep(memory[self.memory.damping], Within(now, names, {}), *measured())

    def view(self, memory: Array, now: Now) -> Now:
        """Returns what the impedance sees: the granted gains.

        Args:
            memory: of this piece.
            now: the inputs of the controller.
        """
        if not self.changes_gains:
            return now
        given: dict[str, Array] = {}
        if self.gains is not None:
            given = self.gains.granted(memory[self.memory.gains], now)
        if self.damping is not None:
            given["damping_scale"] = self.damping.scale(memory[self.memory.damping])
        return Within(now, {}, given, now.memory, now.state)


def _moved(output: Output, place: slice) -> Output:
    """Returns an output of a part's memory, which is at a place in the memory of the whole."""

    def write(now: Now, value: Array) -> None:
        output.write(Within(now, {}, {}, now.memory[place]), value)

    return replace(output, write=write)
