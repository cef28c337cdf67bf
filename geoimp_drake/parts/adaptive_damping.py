"""Damping that rises while a contact rings."""

from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.passivity.alternating_work import raised_damping
from geoimp_drake.parts.part import Memory, Now, Output, held, nested
from geoimp_drake.parts.passivity_observer import ObserverConfig, PassivityObserver
from geoimp_drake.typing import Array
from geoimp_drake.validation import LARGEST, key, positive

__all__ = ["AdaptiveDamping", "AdaptiveDampingConfig"]


@dataclass
class AdaptiveDampingConfig:
    """How much damping rises, and when."""

    most: float = 5.0  # c of (L.7), the largest factor of D
    rise: float = 0.1  # T₁, in which the factor rises from 1 to the most [s]
    fall: float = 10.0  # T₂, time constant with which it falls to 1 again [s]
    observer: ObserverConfig = field(default_factory=ObserverConfig)

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        if not 1.0 <= self.most <= LARGEST:
            raise ConfigurationError(
                f"{key(name, 'most')} is {self.most:g}; it is a factor by which D rises: give a "
                f"number from 1 on."
            )
        for time in ("rise", "fall"):
            positive(getattr(self, time), key(name, time), "s")


class AdaptiveDamping:
    """The part of `systems.adaptive_damping.AdaptiveDamping`; arguments and errors are the same."""

    float_only = "changes the damping step by step"

    def __init__(self, period: float = 1e-3, config: AdaptiveDampingConfig | None = None):
        config = config or AdaptiveDampingConfig()
        config.validate("damping")
        self._config = config
        self._observer = observer = PassivityObserver(period, config.observer)
        self._shares = period / config.rise, period / (config.fall + period)
        self.inputs = observer.inputs
        self.memory = Memory(observer=observer.memory, level=0.0)
        self._alternating = nested(self.memory.observer, observer.memory.alternating)
        self.outputs = (
            Output("damping_scale", 1, self._write, ("memory",)),
            held("given_out", nested(self.memory.observer, observer.memory.given_out)),
            held("alternating", self._alternating),
        )

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Takes the last measurement, once a period."""
        self.keep(memory, now, now["wrench"], now["measured_motion"])

    def keep(self, memory: Array, now: Now, wrench: Array, E: Array) -> None:
        """Does what `begin` does; arguments as of `PassivityObserver.keep`."""
        if self._observer.keep(memory[self.memory.observer], now, wrench, E):
            level, rings = float(memory[self.memory.level]), memory[self._alternating].any()
            memory[self.memory.level] = raised_damping(level, self._shares, rings=bool(rings))

    def scale(self, memory: Array) -> Array:
        """Returns the factor 1 + λ(c − 1) of D (1,), see (L.7), from the memory of this part."""
        return np.array([1.0 + memory[self.memory.level] * (self._config.most - 1.0)])

    def _write(self, now: Now, value: Array) -> None:
        value[:] = self.scale(now.memory)
