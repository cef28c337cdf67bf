"""The impedance between two hands in a sampled loop: which gains hold a stiff grasp.

In a stiff grasp the hands do not move against each other, but the inner loops want them to. In each
sample they ask for the acceleration a = Δẍ + K_D Δẋ + K_P Δx of the references. The internal wrench
h then changes by Λ a, with Λ the apparent inertia of the hands against each other. One sample later
h moves the references by M Δẍ + D Δẋ + K Δx = −h. Two things can go wrong:

- *heavy hands*: at once Δẍ = −M⁻¹h, and h becomes (1 − Λ M⁻¹) h. That grows if an eigenvalue of
  Λ M⁻¹ is above 2.
- *light hands*: between the samples T ḣ = Λ a. With s for the derivative and ν = Λ/T, the loop is M
  s³ + (D + ν) s² + (K + ν K_D) s + ν K_P = 0. By Routh's criterion it is stable for M <
  (D + ν)(K + ν K_D)/(ν K_P). The worst ν is √(D K/K_D), so the loop is stable for every ν if M <
  (√K + √(D K_D))²/K_P.

These laws are used when a controller is made; floats only.
"""

import numpy as np

from geoimp_drake.typing import Array

__all__ = ["growth_rate", "least_damping", "least_mass", "relative_inertia"]

# Heavy hands stay within half of their range even if the apparent inertia doubles during the task.
# Light hands have half of theirs left.
_MARGIN = 2.0
# Damping ratio of the mutual motion in free air, and the largest D T/M that follows from it alone.
_RATIO, _LARGEST_DECAY = np.sqrt(2.0), 0.5


def relative_inertia(J_1: Array, B_1: Array, J_2: Array, B_2: Array) -> Array:
    """Returns Λ = (J_1 B_1⁻¹ J_1ᵀ + J_2 B_2⁻¹ J_2ᵀ)⁻¹ (6, 6), in W [kg m², kg].

    The lever of the mutual position, by which turning hands also move, is left out. It changes
    nothing along that lever, where two arms are heaviest.

    Args:
        J_1: geometric Jacobian of the first hand (6, n), in W.
        B_1: inertia matrix of its arm (n, n).
        J_2: the same of the second hand.
        B_2: the same of the second arm.
    """
    mobility = sum(J @ np.linalg.solve(B, J.T) for J, B in ((J_1, B_1), (J_2, B_2)))
    return np.asarray(np.linalg.inv(mobility))


def least_mass(inertia: float, stiffness: float, K_D: float, period: float) -> float:
    """Returns the least M for heavy hands, with a margin, and for D T/M ≤ 0.5.

    The margin is for Λ(1 + K_D T), since a sample of Δẍ also changes Δẋ. The D of the second
    condition is 2√2 √(KM), the least that `least_damping` returns.

    Args:
        inertia: largest apparent inertia λ_max(Λ) [kg or kg m²].
        stiffness: K [N/m or Nm/rad].
        K_D: of the motion loop [1/s].
        period: T [s].
    """
    light = stiffness * (2.0 * _RATIO * period / _LARGEST_DECAY) ** 2
    return float(max(_MARGIN * inertia * (1.0 + K_D * period), light))


def least_damping(mass: float, stiffness: float, K_P: float, K_D: float) -> float:
    """Returns D with which light hands of any weight are stable for 2M, and at least 2√2 √(KM).

    Args:
        mass: M [kg or kg m²].
        stiffness: K [N/m or Nm/rad].
        K_P: of the motion loop [1/s²].
        K_D: of the motion loop [1/s].
    """
    root = max(np.sqrt(_MARGIN * mass * K_P) - np.sqrt(stiffness), 0.0)
    return float(max(root**2 / K_D, 2.0 * _RATIO * np.sqrt(stiffness * mass)))


def growth_rate(inertia: Array, gains: Array, motion: Array, period: float) -> float:
    """Returns the rate at which a disturbance grows between samples [1/s]; negative is stable.

    Args:
        inertia: Λ (n, n).
        gains: M, D and K of the internal impedance (3, n, n).
        motion: the diagonals of K_P and K_D of the motion loops (2, n).
        period: T [s].
    """
    M, D, K = gains
    K_P, K_D = (np.diag(gain) for gain in motion)
    one, none = np.eye(len(M)), np.zeros_like(M)
    acceleration = -np.linalg.solve(M, np.hstack((K, D, one)))  # Δẍ of [Δx; Δẋ; h]
    asked = acceleration + np.hstack((K_P, K_D, none))
    step = np.vstack(
        (
            np.hstack((one, period * one, none)),
            np.hstack((none, one, none)) + period * acceleration,
            np.hstack((none, none, one)) + inertia @ asked,
        )
    )
    return float(np.log(np.abs(np.linalg.eigvals(step)).max()) / period)
