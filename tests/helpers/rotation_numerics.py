"""Random attitudes, and a derivative that knows nothing of the formulas under test."""

import numpy as np

from geoimp_drake.rotations import quaternion


def random_unit_quaternions(count, seed=0):
    samples = np.random.default_rng(seed).normal(size=(count, 4))
    return [quaternion.normalized(sample) for sample in samples]


def rotation_vectors(count, largest_angle, seed=0):
    rng = np.random.default_rng(seed)
    axes = rng.normal(size=(count, 3))
    angles = rng.uniform(0.05, 1.0, count) * largest_angle
    return [angle * axis / np.linalg.norm(axis) for angle, axis in zip(angles, axes, strict=True)]


def rate_of_change(function, h=1e-5):
    """The derivative at zero of a function of one scalar."""
    return (function(h) - function(-h)) / (2.0 * h)


def assert_close(actual, expected, atol):
    """Every entry within `atol`: numpy's own default would add a relative 1e-7."""
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=atol)
