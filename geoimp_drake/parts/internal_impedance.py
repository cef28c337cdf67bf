"""Gains of the impedance between two hands."""

from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.impedance.families import QuaternionImpedance
from geoimp_drake.parts.impedance import AXES, Impedance
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, choice, key, spd_matrix

__all__ = ["InternalGains", "InternalImpedanceConfig"]

# A damper that is integrated in steps of dt diverges at D dt/M = 2; the grasp in series with it and
# the age of the wrench take their part of that.
_LARGEST_DECAY_PER_STEP = 1.5


@dataclass
class InternalGains:
    """Gains of one part: one number for k I, three for the diagonal, or a 3×3 matrix."""

    mass: Array  # [kg or kg m²]
    damping: Array  # [Ns/m or Nms/rad]
    stiffness: Array  # [N/m or Nm/rad]

    def matrices(self, name: str) -> tuple[Array, Array, Array]:
        """Returns mass, damping and stiffness (3×3 each).

        Raises:
            ConfigurationError: one of them is not symmetric positive definite.
        """
        mass, damping, stiffness = (
            spd_matrix(getattr(self, gain), key(name, gain))
            for gain in ("mass", "damping", "stiffness")
        )
        return mass, damping, stiffness

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a gain cannot be used; `name` is put before it."""
        self.matrices(name)

    def check_period(self, name: str, period: float) -> None:
        """Raises ConfigurationError if the gains cannot be used with a sampling period [s]."""
        mass, damping, _ = self.matrices(name)
        decay = period * float(np.max(np.linalg.eigvals(np.linalg.solve(mass, damping)).real))
        if decay >= _LARGEST_DECAY_PER_STEP:
            raise ConfigurationError(
                f"{key(name, 'damping')} times the period of {period:g} s over "
                f"{key(name, 'mass')} is {decay:.3g}; it must stay below "
                f"{_LARGEST_DECAY_PER_STEP}, since at 2 the motion diverges. Lower the damping, "
                f"raise the mass or shorten the period."
            )


@dataclass
class InternalImpedanceConfig:
    """Gains of the internal impedance; translation in C's axes, rotation in the first hand's."""

    enabled: bool = True
    translation: InternalGains = field(
        default_factory=lambda: InternalGains(np.array(10.0), np.array(400.0), np.array(2000.0))
    )
    rotation: InternalGains = field(
        default_factory=lambda: InternalGains(np.array(0.3), np.array(12.0), np.array(100.0))
    )
    axes: str = "both"  # or translation, rotation: the other part of the mutual pose is constant

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        choice(self.axes, key(name, "axes"), AXES)

    def check_period(self, name: str, period: float) -> None:
        """Raises ConfigurationError if the gains cannot be used with a sampling period [s]."""
        for part in ("translation", "rotation"):
            getattr(self, part).check_period(key(name, part), period)

    def make(self, name: str = "internal", period: float = 1e-3) -> Impedance:
        """Returns the part."""
        check(self, name)
        self.check_period(name, period)
        rotation = QuaternionImpedance(*self.rotation.matrices(f"{name}.rotation"))
        return Impedance(*self.translation.matrices(f"{name}.translation"), rotation, self.axes)
