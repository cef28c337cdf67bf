"""Angle/axis representations ᶜo = f(ϑ) r of an orientation, Table 2.1.

With η = cos(ϑ/2) ≥ 0 and ε = sin(ϑ/2) r, each of them is o = k ε. The matrix of (3.13) is Ω = a I +
b εεᵀ − ½ k S(ε). The scalars k, a, b are smooth in η and ‖ε‖². This form has no division by ϑ,
needs no axis where there is none, and has derivatives at ϑ = 0.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import matrix
from geoimp_drake.errors import ConfigurationError, OutOfDomainError
from geoimp_drake.rotations.components import wxyz
from geoimp_drake.rotations.quaternion import angle_over_sine
from geoimp_drake.typing import Array

__all__ = [
    "REPRESENTATIONS",
    "Representation",
    "check_domain",
    "displacement",
    "displacement_of",
    "displacement_rate",
    "omega",
    "omega_of",
    "representation",
]

# The interval of η in which a half turn is reported: with 1 ms samples it catches up to 4 rad/s.
SMALLEST_ETA = 1e-3


Coefficients = Callable[[float, float], tuple[float, float, float]]


class Representation(NamedTuple):
    """One row of Table 2.1.

    Attributes:
        name: the name in scenarios.
        f: f(ϑ), strictly increasing for |ϑ| < `theta_max`.
        f_prime: f′(ϑ).
        f_prime_at_zero: f′(0).
        theta_max: ϑ_M [rad].
        smallest_eta: the value of η at which ϑ_M is reported.
        coefficients: (η, ‖ε‖²) → (k, a, b) of this module's docstring.
    """

    name: str
    f: Callable[[float], float]
    f_prime: Callable[[float], float]
    f_prime_at_zero: float
    theta_max: float
    smallest_eta: float
    coefficients: Coefficients


@compilable
def _sin(eta: float, s2: float) -> tuple[float, float, float]:
    return 2.0 * eta, eta * eta, -1.0


@compilable
def _sin_half(eta: float, s2: float) -> tuple[float, float, float]:
    return 1.0, 0.5 * eta, 0.0


@compilable
def _tan_half(eta: float, s2: float) -> tuple[float, float, float]:
    k = 1.0 / eta
    return k, 0.5, 0.5 * k * k


@compilable
def _simple(eta: float, s2: float) -> tuple[float, float, float]:
    k = angle_over_sine(eta, s2)
    a = 0.5 * k * eta
    if s2 < 1e-4:
        b = 1.0 / 3.0 + s2 * (2.0 / 15.0 + s2 * (8.0 / 105.0 + s2 * (16.0 / 315.0)))
    else:
        b = (1.0 - a) / s2
    return k, a, b


REPRESENTATIONS = {
    row.name: row
    for row in (
        Representation("sin", np.sin, np.cos, 1.0, 0.5 * math.pi, math.cos(0.25 * math.pi), _sin),
        Representation(
            "sin-half",
            lambda theta: np.sin(0.5 * theta),
            lambda theta: 0.5 * np.cos(0.5 * theta),
            0.5,
            math.pi,
            SMALLEST_ETA,
            _sin_half,
        ),
        Representation(
            "tan-half",
            lambda theta: np.tan(0.5 * theta),
            lambda theta: 0.5 / np.cos(0.5 * theta) ** 2,
            0.5,
            math.pi,
            SMALLEST_ETA,
            _tan_half,
        ),
        Representation(
            "simple", lambda theta: theta, lambda theta: 1.0, 1.0, math.pi, SMALLEST_ETA, _simple
        ),
    )
}


def representation(name: str) -> Representation:
    """The row of Table 2.1 called `name`.

    Raises:
        ConfigurationError: there is no such row; the message lists the names.
    """
    if name not in REPRESENTATIONS:
        names = ", ".join(REPRESENTATIONS)
        raise ConfigurationError(f"no angle/axis function is called {name!r}: use one of {names}.")
    return REPRESENTATIONS[name]


def displacement(row: Representation, Q: Array) -> Array:
    """(3.11), (2.13) ᶜo = f(ϑ) ᶜr (3,), of the unit quaternion `Q` with η ≥ 0."""
    return displacement_of(row.coefficients, Q)


def omega(row: Representation, Q: Array) -> Array:
    """(3.13) Ω = f′ rrᵀ + ½ f cot(ϑ/2)(I − rrᵀ) − ½ S(ᶜo) (3, 3); (3.14) Ω = f′(0) I at ϑ = 0.

    `Q` is a unit quaternion with η ≥ 0.
    """
    return omega_of(row.coefficients, Q)


@compilable
def displacement_of(coefficients: Coefficients, Q: Array) -> Array:
    """The displacement with the coefficients of a row: see `displacement`."""
    epsilon = Q[1:]
    k, _, _ = coefficients(Q[0], epsilon @ epsilon)
    return k * epsilon


@compilable
def omega_of(coefficients: Coefficients, Q: Array) -> Array:
    """The matrix Ω with the coefficients of a row: see `omega`."""
    eta, x, y, z = wxyz(Q)
    k, a, b = coefficients(eta, x * x + y * y + z * z)
    bx, by, h = b * x, b * y, 0.5 * k
    xy, xz, yz = bx * y, bx * z, by * z
    hx, hy, hz = h * x, h * y, h * z
    return matrix(
        (a + bx * x, xy + hz, xz - hy),
        (xy - hz, a + by * y, yz + hx),
        (xz + hy, yz - hx, a + b * z * z),
    )


def displacement_rate(row: Representation, Q_CD: Array, w_CD_C: Array) -> Array:
    """(3.12) ᶜȯ_dc = Ω Δᶜω_dc (3,), with Δᶜω_dc = `w_CD_C` [rad/s] in C."""
    return omega(row, Q_CD) @ w_CD_C


def check_domain(row: Representation, Q: Array) -> None:
    """Refuses a relative orientation beyond ϑ_M, where f no longer increases.

    Raises:
        OutOfDomainError: ϑ ≥ ϑ_M; for ϑ_M = 180°, where ϑ turns back, η ≤ 1e-3 (ϑ ≥ 179.9°).
    """
    if not Q[0] > row.smallest_eta:
        theta = 2.0 * math.degrees(math.acos(min(1.0, max(-1.0, float(Q[0])))))
        raise OutOfDomainError(
            f"angle/axis with f = {row.name}: the relative orientation is {theta:.2f}° and f "
            f"increases only below {math.degrees(row.theta_max):.0f}°. Reduce the moment, raise "
            "the rotational stiffness, or use the quaternion."
        )
