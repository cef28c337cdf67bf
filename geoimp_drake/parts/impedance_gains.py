"""The gains of an impedance: as configured, or as signals say."""

from functools import lru_cache

import numpy as np

from geoimp_drake.compilation.small_arrays import numbers
from geoimp_drake.errors import SignalError
from geoimp_drake.parts.part import Now
from geoimp_drake.parts.signals import check_signal
from geoimp_drake.typing import Array

__all__ = ["GAIN_PORTS", "ImpedanceGains", "LawGains"]

# Inputs that change the gains, with their sizes. They are factors of K_p and of K_o, in this order;
# K and D (6×6) row by row, [angular; linear]; and a factor of D.
GAIN_PORTS = {"stiffness_scale": 2, "stiffness": 36, "damping": 36, "damping_scale": 1}

# What `compliant_motion` takes: translation, rotation, coupling, parts.
LawGains = tuple[Array, Array, Array, Array]

# Asymmetry and negative eigenvalues below this share of the largest entry are rounding.
_ROUNDING = 1e-9


class ImpedanceGains:
    """Gains as `compliant_motion` takes them.

    Args:
        translation: M_p⁻¹, D_p and K_p (3, 3, 3).
        rotation: M_o⁻¹, D_o and K_o (3, 3, 3).
        K_c: coupling (3, 3); None for none.
        parts: whether translation and rotation are compliant, and whether `translation` is in D.
        has_couplings: whether the orientation family takes a coupling.

    Attributes:
        configured: the gains without signals.
    """

    def __init__(
        self,
        translation: Array,
        rotation: Array,
        K_c: Array | None,
        parts: tuple[bool, bool, bool],
        *,
        has_couplings: bool,
    ):
        translates, rotates, in_desired = parts
        none = np.zeros((3, 3))
        self.configured: LawGains = (
            translation,
            rotation,
            np.array([none if K_c is None else K_c, none]),
            np.array([translates, rotates, K_c is not None, in_desired, False]),
        )
        self._couples = has_couplings and translates and rotates
        self._is_stiffness_in_desired = in_desired or K_c is not None

    def at(self, now: Now | None) -> LawGains:
        """Returns the gains that signals ask for; the configured ones where there is no signal.

        Args:
            now: the inputs, those of `GAIN_PORTS` among them if connected; None for none.

        Raises:
            SignalError: a factor is not positive and finite, or a matrix not finite, symmetric and
                positive semidefinite, or it couples what cannot be coupled. Or factors of K_p and
                K_o make K indefinite with its coupling.
        """
        if now is None or not now.has_any(GAIN_PORTS):
            return self.configured
        *gains, parts = self.configured
        kind = next(now[name].dtype for name in GAIN_PORTS if now.has(name))
        translation, rotation, coupling = (gain.astype(kind) for gain in gains)
        parts = parts.copy()
        if now.has("stiffness"):
            rotation[2], coupling[0], translation[2] = self._blocks(now, "stiffness")
            parts[2] |= (coupling[0] != 0.0).any()
        if now.has("damping"):
            rotation[1], coupling[1], translation[1] = self._blocks(now, "damping")
            parts[4] = (coupling[1] != 0.0).any()
        if now.has("stiffness_scale"):
            p, o = _factors(now, "stiffness_scale")
            translation[2] *= p
            rotation[2] *= o
            self._check_scaled(now, rotation[2], coupling[0], translation[2])
        if now.has("damping_scale"):
            (factor,) = _factors(now, "damping_scale")
            for damping in (translation[1], rotation[1], coupling[1]):
                damping *= factor
        return translation, rotation, coupling, parts

    def matrices(self, now: Now | None = None) -> tuple[Array, Array]:
        """Returns K and D of the same gains as matrices, row by row (36,) each.

        Raises:
            SignalError: as `at`.
        """
        (_, D_p, K_p), (_, D_o, K_o), (K_c, D_c), _ = self.at(now)
        return _joined(K_o, K_c, K_p), _joined(D_o, D_c, D_p)

    def of(self, stiffness: Array, damping: Array) -> LawGains:
        """Returns the gains with K and D (36,) as `matrices` returns them, without a check."""
        translation, rotation, coupling, parts = (gain.copy() for gain in self.configured)
        rotation[2], coupling[0], translation[2] = _split(stiffness)
        rotation[1], coupling[1], translation[1] = _split(damping)
        parts[2] |= coupling[0].any()
        parts[4] = coupling[1].any()
        return translation, rotation, coupling, parts

    def _blocks(self, now: Now, name: str) -> tuple[Array, Array, Array]:
        """Returns the blocks of rotation, of coupling and of translation of a matrix at a port."""
        value, port = now[name], now.port(name)
        check_signal(value, port)
        fault = _fault(numbers(value).tobytes())
        if fault:
            raise SignalError(f"Port '{port}' got a matrix {fault}")
        rotation, coupling, translation = _split(value)
        if (coupling != 0.0).any():
            self._check_coupling(port, name)
        return rotation, coupling, translation

    def _check_scaled(self, now: Now, K_o: Array, K_c: Array, K_p: Array) -> None:
        if (K_c != 0.0).any() and (fault := _fault(numbers(_joined(K_o, K_c, K_p)).tobytes())):
            raise SignalError(f"Port '{now.port('stiffness_scale')}' makes K a matrix {fault}")

    def _check_coupling(self, port: str, name: str) -> None:
        if not self._couples:
            raise SignalError(
                f"Port '{port}' got a matrix that couples rotation and translation, which is "
                f"defined for the orientation family 'quaternion' on both parts. Give zeros off "
                f"the blocks of 3×3."
            )
        if name == "stiffness" and not self._is_stiffness_in_desired:
            raise SignalError(
                f"Port '{port}' got a matrix that couples rotation and translation; with a "
                f"coupling K_p is in D, and here it is in W. Give impedance.translation.axes: "
                f"desired, or zeros off the blocks of 3×3."
            )


def _split(matrix: Array) -> tuple[Array, Array, Array]:
    gain = matrix.reshape(6, 6)
    return gain[:3, :3].copy(), gain[:3, 3:].copy(), gain[3:, 3:].copy()


def _joined(rotation: Array, coupling: Array, translation: Array) -> Array:
    return np.block([[rotation, coupling], [coupling.T, translation]]).ravel()


@lru_cache(maxsize=16)
def _fault(data: bytes) -> str:
    """Returns what is wrong with a matrix (36,), empty for nothing; a gain seldom changes."""
    matrix = np.frombuffer(data).reshape(6, 6)
    largest = np.abs(matrix).max()
    asymmetry = np.abs(matrix - matrix.T).max()
    if asymmetry > _ROUNDING * largest:
        return f"an entry of which differs from its mirror image by {asymmetry:.3g}; give K = Kᵀ."
    smallest = np.linalg.eigvalsh(matrix)[0]
    if smallest < -_ROUNDING * largest:
        return f"whose smallest eigenvalue is {smallest:.6g}; none may be negative."
    return ""


def _factors(now: Now, name: str) -> Array:
    value: Array = now[name]
    factors = numbers(value)
    if not (np.isfinite(factors).all() and factors.min() > 0.0):
        raise SignalError(
            f"Port '{now.port(name)}' got {' and '.join(f'{factor:g}' for factor in factors)}; "
            f"factors must be positive and finite."
        )
    return value
