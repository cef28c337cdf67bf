"""One sample in one call: what reading, peak and wrench are one after the other."""

import numpy as np
import pytest

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.compositions.sensor_sample import sensor_sample
from geoimp_drake.laws.sensing.sensed_wrench import sensed_wrench
from geoimp_drake.laws.sensing.sensor_reading import peak_reading, sensor_reading
from geoimp_drake.rotations import quaternion

RESOLUTION = np.repeat([0.005, 0.06], 3)
LIMITS = np.repeat([3.0, 40.0], 3)
GAIN = 0.3
BOTH = pytest.mark.parametrize("law", [sensor_sample, compiled(sensor_sample)])


def pose(rng: np.random.Generator) -> np.ndarray:
    R = quaternion.to_rotation(quaternion.exp(rng.normal(size=3)))
    return np.asfortranarray(np.column_stack((R, rng.normal(size=3))))


def random_sample(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple]:
    """Returns reaction, pose and motion of the tool, and its load."""
    rng = np.random.default_rng(seed)
    motion = rng.normal(size=19)
    motion[:4] /= np.linalg.norm(motion[:4])
    A = rng.normal(size=(3, 3))
    load = pose(rng), rng.normal(size=3), 1.3, rng.normal(size=3), A @ A.T, rng.normal(size=3)
    return rng.normal(size=6) * LIMITS, pose(rng), motion, load


@BOTH
def test_sample_is_reading_then_peak_then_wrench(law) -> None:
    reading, peak, h = np.zeros((3, 6))
    said = []
    for seed in range(20):
        raw, X_WT, motion, load = random_sample(seed)
        before, peak_before, h_expected = reading.copy(), peak.copy(), np.empty(6)
        said.append(law(X_WT, raw, motion, GAIN, RESOLUTION, LIMITS, *load, reading, peak, h))
        expected, peak_expected = np.empty((2, 6))
        assert sensor_reading(raw, before, RESOLUTION, LIMITS, GAIN, expected)
        saturates = peak_reading(raw, peak_before, LIMITS, peak_expected)
        assert sensed_wrench(expected, X_WT, *load, motion, h_expected)
        assert said[-1] == (True, saturates)
        np.testing.assert_allclose(reading, expected, rtol=1e-12)
        np.testing.assert_allclose(peak, peak_expected, rtol=1e-12)
        np.testing.assert_allclose(h, h_expected, rtol=1e-12, atol=1e-12)
    assert {saturates for _, saturates in said} == {True, False}


@BOTH
def test_what_is_not_finite_is_said_and_not_written(law) -> None:
    raw, X_WT, motion, load = random_sample(0)
    raw[2] = 5.0  # beyond the range
    for spoilt, saturates in ((raw, False), (motion, True)):
        reading, peak, h = np.zeros((3, 6))
        value, spoilt[7 % len(spoilt)] = spoilt[7 % len(spoilt)], np.nan
        said = law(X_WT, raw, motion, GAIN, RESOLUTION, LIMITS, *load, reading, peak, h)
        spoilt[7 % len(spoilt)] = value
        assert said == (False, saturates)
        assert not h.any()
