"""Random gains, attitudes and motions for the property tests, and finite differences."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from geoimp_drake.laws.impedance.families import FAMILIES, make_family
from geoimp_drake.rotations import quaternion

GEOMETRIC = [name for name in FAMILIES if name == "quaternion" or name.startswith("angle-axis")]
INDEPENDENT_OF_ATTITUDE = [*GEOMETRIC, "alternative-euler"]

every_family = pytest.mark.parametrize("name", list(FAMILIES))
geometric_families = pytest.mark.parametrize("name", GEOMETRIC)

# Every relative rotation below stays inside the narrowest domain, 90° of sin ϑ.
LARGEST_ANGLE = 1.4


def random_spd(rng, low, high):
    """A full symmetric positive definite matrix with eigenvalues between `low` and `high`."""
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return (axes * rng.uniform(low, high, 3)) @ axes.T


def random_family(name, rng):
    return make_family(
        name, random_spd(rng, 0.2, 0.6), random_spd(rng, 1.0, 4.0), random_spd(rng, 1.0, 10.0)
    )


def random_attitude(rng):
    """A unit quaternion anywhere, except near pitch ±π/2 where classical Euler is singular."""
    while True:
        Q = quaternion.normalized(rng.normal(size=4))
        if abs(quaternion.to_rotation(Q)[0, 2]) < 0.95:
            return Q


def random_rotvec(rng, largest=LARGEST_ANGLE):
    axis = rng.normal(size=3)
    return rng.uniform(0.1, 1.0) * largest * axis / np.linalg.norm(axis)


@dataclass
class Moment:
    """One instant of D and C: orientations, angular velocities and accelerations in W."""

    Q_WD: np.ndarray
    w_WD: np.ndarray
    dw_WD: np.ndarray
    Q_WC: np.ndarray
    w_WC: np.ndarray
    dw_WC: np.ndarray
    mu_W: np.ndarray

    def after(self, t):
        """The same to second order in t: ω = ω(0) + ω̇ t, and orientations that belong to it."""
        return replace(
            self,
            Q_WD=_turned(self.Q_WD, self.w_WD, self.dw_WD, t),
            w_WD=self.w_WD + self.dw_WD * t,
            Q_WC=_turned(self.Q_WC, self.w_WC, self.dw_WC, t),
            w_WC=self.w_WC + self.dw_WC * t,
        )

    def attitudes(self):
        return self.Q_WD, self.Q_WC

    def motion(self):
        return self.Q_WD, self.w_WD, self.Q_WC, self.w_WC

    def law_input(self):
        return self.Q_WD, self.w_WD, self.dw_WD, self.Q_WC, self.w_WC, self.mu_W


def _turned(Q, w, dw, t):
    return quaternion.product(quaternion.exp(w * t + 0.5 * dw * t * t), Q)


def random_moment(rng, largest=LARGEST_ANGLE):
    while True:
        Q_WC = random_attitude(rng)
        Q_WD = quaternion.product(Q_WC, quaternion.exp(random_rotvec(rng, largest)))
        if abs(quaternion.to_rotation(Q_WD)[0, 2]) < 0.95:
            return Moment(Q_WD, *rng.normal(size=(2, 3)), Q_WC, *rng.normal(size=(3, 3)))


def moments(count, seed=0, largest=LARGEST_ANGLE):
    rng = np.random.default_rng(seed)
    return [random_moment(rng, largest) for _ in range(count)]


def rate_of_change(function, h=1e-5):
    """The derivative at zero of a function of one scalar."""
    return (function(h) - function(-h)) / (2.0 * h)


def acceleration_of(function, h=3e-4):
    """The second derivative at zero of a function of one scalar."""
    return (function(h) - 2.0 * function(0.0) + function(-h)) / (h * h)


def jacobian(function, x, h=1e-6):
    """The derivative of a function of a vector, a column for each of its entries."""
    steps = h * np.eye(len(x))
    return np.stack([(function(x + s) - function(x - s)) / (2.0 * h) for s in steps], axis=-1)


def rotation_gradient(potential, Q_CD):
    """The gradient (3,), in C, of a potential of Q_CD when D turns."""
    return np.array(
        [
            rate_of_change(
                lambda d, e=e: potential(quaternion.product(quaternion.exp(d * e), Q_CD))
            )
            for e in np.eye(3)
        ]
    )


def assert_close(actual, expected, atol):
    """Every entry within `atol`: numpy's own default would add a relative 1e-7."""
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=atol)
