"""Poles as modes: frequency, damping ratio, time constant; floats only."""

from dataclasses import dataclass

import numpy as np

from geoimp_drake.typing import Array

__all__ = ["Mode", "modes_of", "second_order_poles"]

# An imaginary part below this share of a pole is rounding, as at a double pole.
_REAL = 1e-6


@dataclass(frozen=True)
class Mode:
    """A pole, or a pair of them: s² + 2ζω s + ω² = 0."""

    frequency: float  # ω = |s| [rad/s]
    damping_ratio: float  # ζ = −Re s / |s|; below one it rings, below zero it grows
    time_constant: float  # −1 / Re s, infinite on the imaginary axis, negative where it grows [s]

    @property
    def ringing(self) -> float:
        """The frequency of the visible ringing, ω √(1 − ζ²) [rad/s]; zero where the mode creeps."""
        return self.frequency * float(np.sqrt(max(0.0, 1.0 - self.damping_ratio**2)))


def modes_of(poles: Array) -> list[Mode]:
    """Returns the modes of poles (n,), the least stable first; a conjugate pair is one mode."""
    poles = np.asarray(poles, dtype=complex)
    kept = [s for s in poles if s.imag >= -_REAL * abs(s)]
    return [
        Mode(
            float(abs(s)),
            float(-s.real / abs(s)) if s else 1.0,
            float(-1.0 / s.real) if s.real else np.inf,
        )
        for s in sorted(kept, key=lambda s: (-s.real, abs(s)))
    ]


def second_order_poles(M_inv: Array, D: Array, K: Array) -> Array:
    """Returns the 2n poles of M ẍ + D ẋ + K x = 0 (complex) [1/s].

    Args:
        M_inv: M⁻¹ (n, n), zero where nothing moves.
        D: damping (n, n).
        K: stiffness (n, n).
    """
    n = len(M_inv)
    rate = np.block([[np.zeros((n, n)), np.eye(n)], [-M_inv @ K, -M_inv @ D]])
    poles: Array = np.linalg.eigvals(rate)
    return poles
