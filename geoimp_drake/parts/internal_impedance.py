"""Gains of the impedance between two hands."""

from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.impedance.families import QuaternionImpedance
from geoimp_drake.parts.impedance import AXES, Impedance
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, choice, key, spd_matrix

__all__ = ["InternalGains", "InternalImpedanceConfig", "is_open"]

# A damper that is integrated in steps of dt diverges at D dt/M = 2. The stiffness of the grasp and
# the age of the wrench lower that bound.
_LARGEST_DECAY_PER_STEP = 1.5


_GAINS = ("mass", "damping", "stiffness")


def is_open(gain: Array) -> bool:
    """Whether a gain is left to follow from the arms."""
    return np.ndim(gain) == 0 and gain == 0


@dataclass
class InternalGains:
    """Gains of one part: one number for k I, three for the diagonal, or a 3×3 matrix.

    Zero leaves a gain open: it follows from the arms when a controller is made, see
    `controllers.internal_gains`.
    """

    mass: Array = field(default_factory=lambda: np.array(0.0))  # [kg or kg m²]
    damping: Array = field(default_factory=lambda: np.array(0.0))  # [Ns/m or Nms/rad]
    stiffness: Array = field(default_factory=lambda: np.array(0.0))  # [N/m or Nm/rad]

    def matrices(self, name: str) -> tuple[Array, Array, Array]:
        """Returns mass, damping and stiffness (3×3 each).

        Raises:
            ConfigurationError: one of them is open, or not symmetric positive definite.
        """
        for gain in _GAINS:
            if is_open(getattr(self, gain)):
                raise ConfigurationError(
                    f"{key(name, gain)} is zero: it follows from the arms of a controller. "
                    f"Without arms give a number."
                )
        mass, damping, stiffness = (
            spd_matrix(getattr(self, gain), key(name, gain)) for gain in _GAINS
        )
        return mass, damping, stiffness

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a gain cannot be used; `name` is put before it."""
        for gain in _GAINS:
            if not is_open(value := getattr(self, gain)):
                spd_matrix(value, key(name, gain))

    def check_period(self, name: str, period: float) -> None:
        """Raises ConfigurationError if the gains cannot be used with a sampling period [s]."""
        if is_open(self.mass) or is_open(self.damping):
            return
        mass, damping = (spd_matrix(getattr(self, gain), key(name, gain)) for gain in _GAINS[:2])
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
    """Gains of the internal impedance.

    Those of translation are in C's axes. Those of rotation are in the axes of the second hand's
    reference, which the laws put in the place of C.
    """

    enabled: bool = True
    translation: InternalGains = field(default_factory=InternalGains)
    rotation: InternalGains = field(default_factory=InternalGains)
    axes: str = "both"  # or translation, rotation, none: the rest of the mutual pose is constant

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        choice(self.axes, key(name, "axes"), AXES)

    def check_period(self, name: str, period: float) -> None:
        """Raises ConfigurationError if the gains cannot be used with a sampling period [s]."""
        for part in ("translation", "rotation"):
            getattr(self, part).check_period(key(name, part), period)

    def make(self, name: str = "internal", period: float = 1e-3, remedy: str = "") -> Impedance:
        """Returns the part.

        Args:
            name: of the configuration, for errors.
            period: of the samples [s].
            remedy: the advice in the part's error if the motion diverges.

        Raises:
            ConfigurationError: a gain is open or cannot be used, or does not fit the period.
        """
        check(self, name)
        self.check_period(name, period)
        rotation = QuaternionImpedance(*self.rotation.matrices(f"{name}.rotation"))
        translation = self.translation.matrices(f"{name}.translation")
        return Impedance(*translation, rotation, self.axes, remedy=remedy)
