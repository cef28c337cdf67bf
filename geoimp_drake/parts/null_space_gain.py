"""The gain of the null-space motion, and the watch over a constant one."""

import logging

import numpy as np

from geoimp_drake.arm.state import ArmState
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.compositions.null_space_rates import null_space_rates
from geoimp_drake.typing import Array
from geoimp_drake.validation import key, positive, spd_matrix

__all__ = ["DEFAULT_KAPPA", "GainWatch", "null_space_gain"]

_log = logging.getLogger("drake")

# Null-space motion falls to 1 % in half a second. With κB a sixth of the damping of the inner loop,
# the null space adds little to what noise and sampling do there [1/s].
DEFAULT_KAPPA = 10.0

# Period times rate of decay beyond which null-space motion grows.
_UNSTABLE = 2.0


def null_space_gain(
    K_n: float | Array, kappa: float | None, n: int, name: str = ""
) -> tuple[Array, float]:
    """Returns K (n, n) and κ of the gain K + κB: one of them is zero.

    Args:
        K_n: a constant gain, as for `spd_matrix`, or zero.
        kappa: a rate [1/s]; None is the default rate if K_n is zero.
        n: number of joints.
        name: of the configuration, for errors.

    Raises:
        ConfigurationError: both are given, or one cannot be used.
    """
    if not np.any(K_n):
        rate = DEFAULT_KAPPA if kappa is None else kappa
        positive(rate, key(name, "kappa"), "1/s")
        return np.zeros((n, n)), float(rate)
    if kappa is not None:
        raise ConfigurationError(
            f"{key(name, 'K_n')} is {np.asarray(K_n).tolist()} and {key(name, 'kappa')} is "
            f"{kappa:g} 1/s; give one of them, K_n: 0 or kappa: null."
        )
    return spd_matrix(np.asarray(K_n), key(name, "K_n"), n), 0.0


class GainWatch:
    """Finds where a constant gain K_n is too large for the period, and warns of it.

    Null-space motion decays by ė_n = −NB⁻¹K_n e_n. Between two readings the torques are held, so
    the motion grows if the period times a rate of decay exceeds 2. The rates depend on the posture.

    Args:
        K: K_n (n, n).
        terms: W⁻¹ (n, n), whether W = B instead, σ₀ and λ₀, for `null_space_rates`.
        period: of the joints' readings [s].

    Attributes:
        period: as given.
        limit: rate of decay beyond which null-space motion grows [1/s].
    """

    def __init__(self, K: Array, terms: tuple, period: float):
        self._K, self._terms, self.period = K, terms, period
        self.limit = _UNSTABLE / period
        self._law = compiled(null_space_rates(len(K)))

    def bound(self, arm: ArmState) -> float:
        """Returns `null_space_decay_bound` at a posture, for a cheap first look."""
        return self._decay(arm)[1]

    def is_too_large(self, arm: ArmState, system: str, time: float) -> bool:
        """Returns whether K_n is too large at a posture, and then warns.

        Args:
            arm: the arm.
            system: its name in the warning.
            time: [s].
        """
        A, _ = self._decay(arm)
        rate = float(np.abs(np.linalg.eigvals(A)).max())
        if rate <= self.limit:
            return False
        _log.warning(
            f"{system}: K_n of the null-space motion is too large at t = {time:.3f} s: the "
            f"motion grows where the period, {self.period:g} s, times its rate of decay exceeds "
            f"{_UNSTABLE:g}, and in this posture that is {self.period * rate:.3g}. Give kappa, a "
            f"rate in 1/s, instead of K_n, or a K_n more than "
            f"{self.period * rate / _UNSTABLE:.3g} times smaller."
        )
        return True

    def _decay(self, arm: ArmState) -> tuple[Array, float]:
        return self._law(arm.Jv_V_WE, arm.B, self._K, *self._terms)
