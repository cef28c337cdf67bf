"""Mass and damping by what they mean: a natural frequency and a damping ratio."""

from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.impedance.damping_design import damping_of_design, mass_for_frequency
from geoimp_drake.typing import Array
from geoimp_drake.validation import key, spd_matrix, symmetric

__all__ = ["GAINS", "GainDesign"]

GAINS = ("mass", "damping", "stiffness")


@dataclass
class GainDesign:
    """What mass, damping and stiffness follow from: a number, three for the axes, or 3×3 each."""

    natural_frequency: Array = field(default_factory=lambda: np.array(0.0))  # √(K/M) [rad/s]
    damping_ratio: Array = field(default_factory=lambda: np.array(1.0))  # ζ, for K + K_e
    stiffness: Array = field(default_factory=lambda: np.array(0.0))  # K [N/m or Nm/rad]
    environment_stiffness: Array = field(default_factory=lambda: np.array(0.0))  # K_e, 0 for none

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        self.gains(name)

    def gains(self, name: str = "design") -> tuple[Array, Array, Array]:
        """Returns mass, damping and stiffness: numbers or vectors if all fields are.

        Raises:
            ConfigurationError: a field cannot be used; `name` is put before it.
        """
        W, zeta, K = (
            spd_matrix(getattr(self, part), key(name, part))
            for part in ("natural_frequency", "damping_ratio", "stiffness")
        )
        K_e = self._environment(key(name, "environment_stiffness"))
        M = mass_for_frequency(K, W)
        D = damping_of_design(M, K + K_e, zeta)
        return self._as_short(M), self._as_short(D), self._as_short(K)

    def _environment(self, name: str) -> Array:
        given = np.asarray(self.environment_stiffness)
        if given.shape not in ((), (3,), (3, 3)):
            raise ConfigurationError(
                f"{name} has shape {given.shape}; give one number, 3 numbers or a 3×3 matrix."
            )
        K_e = symmetric(given if given.ndim == 2 else np.diag(np.broadcast_to(given, 3)), name)
        if (least := float(np.linalg.eigvalsh(K_e)[0])) < 0.0:
            raise ConfigurationError(
                f"{name} has the eigenvalue {least:.6g}; an environment cannot pull: give "
                "eigenvalues of 0 or more."
            )
        return K_e

    def _as_short(self, gain: Array) -> Array:
        size = max(np.ndim(value) for value in vars(self).values())
        return gain if size > 1 else np.diag(gain).copy() if size else np.array(gain[0, 0])
