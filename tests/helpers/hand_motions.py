"""Random poses and smooth motions of two hands, and derivatives by finite differences."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from geoimp_drake.laws.cooperation import mutual_pose
from geoimp_drake.rotations import quaternion


def random_quaternion(rng) -> np.ndarray:
    return quaternion.normalized(rng.normal(size=4))


def rate(function: Callable[[float], np.ndarray], t: float = 0.0, h: float = 1e-3) -> np.ndarray:
    """The derivative by five points; its error is of the order h⁴."""
    return (
        8.0 * (function(t + h) - function(t - h)) - function(t + 2 * h) + function(t - 2 * h)
    ) / (12.0 * h)


def angular_velocity(Q: Callable[[float], np.ndarray], t: float = 0.0) -> np.ndarray:
    """ω in W of an orientation that is a function of time: 2 Q̇ * Q⁻¹."""
    return 2.0 * quaternion.product(rate(Q, t), quaternion.conjugate(Q(t)))[1:]


@dataclass
class Wave:
    """A smooth function of time with a value, three entries of each coefficient."""

    offset: np.ndarray
    amplitude: np.ndarray
    rate: np.ndarray

    def __call__(self, t: float) -> np.ndarray:
        return self.offset + self.amplitude * np.sin(self.rate * t + 0.4)


def random_wave(rng, size: float = 0.3) -> Wave:
    return Wave(rng.normal(size=3), size * rng.normal(size=3), rng.uniform(1.0, 3.0, 3))


@dataclass
class Rotating:
    """An orientation that turns by a rotation vector which is a function of time."""

    start: np.ndarray
    rotvec: Callable[[float], np.ndarray]

    def __call__(self, t: float) -> np.ndarray:
        return quaternion.product(quaternion.exp(self.rotvec(t)), self.start)


def random_rotation(rng, size: float = 0.3) -> Rotating:
    return Rotating(random_quaternion(rng), random_wave(rng, size))


def hands_about(Q_WO, p_WO, Q_12, p_12_O) -> tuple[tuple, tuple]:
    """Poses (Q, p) of the hands that hold an object between them, without the laws under test."""
    half = quaternion.exp(0.5 * rotation_vector(Q_12))
    p = 0.5 * quaternion.to_rotation(Q_WO) @ p_12_O
    Q_W1 = quaternion.product(Q_WO, quaternion.conjugate(half))
    return (Q_W1, p_WO - p), (quaternion.product(Q_W1, Q_12), p_WO + p)


def rotation_vector(Q: np.ndarray) -> np.ndarray:
    """ϑ r with ϑ in (0, 2π), that of Q and not of −Q."""
    s = np.linalg.norm(Q[1:])
    return 2.0 * np.arctan2(s, Q[0]) * Q[1:] / s


def same_rotation(A: np.ndarray, B: np.ndarray) -> float:
    """How far two quaternions are from being the same rotation."""
    return min(np.abs(A - B).max(), np.abs(A + B).max())


def mutual(Q_W1: np.ndarray, Q_W2: np.ndarray) -> np.ndarray:
    return mutual_pose.mutual_orientation_at_start(Q_W1, Q_W2)
