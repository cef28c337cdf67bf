"""A load and a bias are found from postures, and a load's inertia from a motion."""

import numpy as np
import pytest

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.sensing.load_identification import identify_load, load_regressor
from geoimp_drake.laws.sensing.sensed_wrench import inertial_acceleration, load_of_tool
from geoimp_drake.rotations.so3 import exp, x_rotation

GRAVITY = np.array([0.0, 0.0, -9.81])
MASS, CENTRE = 0.8, np.array([0.01, -0.02, 0.06])
INERTIA = np.array([[4e-3, 3e-4, -2e-4], [3e-4, 5e-3, 1e-4], [-2e-4, 1e-4, 2e-3]])
BIAS = np.array([0.05, -0.08, 0.03, 1.5, -2.0, 0.7])
AT_REST = (np.zeros(3),) * 3


def tilted(angle: float, count: int = 6) -> list[np.ndarray]:
    """Returns attitudes of a hand that points down, tilted to all sides."""
    around = 2 * np.pi * np.arange(count) / count
    axes = np.column_stack((np.cos(around), np.sin(around), np.zeros(count)))
    return [exp(angle * axis) @ x_rotation(np.pi) for axis in axes]


def reading(R: np.ndarray, motion: tuple[np.ndarray, ...] = AT_REST) -> np.ndarray:
    """Returns what a sensor reads under the load, by the law that removes it."""
    w, dw, a = motion
    c = R @ CENTRE
    a_C = inertial_acceleration(a, w, dw, c)
    wrench = load_of_tool(MASS, c, R @ INERTIA @ R.T, GRAVITY, a_C, w, dw)
    return np.concatenate([R.T @ part for part in wrench]) + BIAS


def test_postures_give_mass_centre_and_bias():
    attitudes = tilted(np.deg2rad(60.0))
    load = identify_load([reading(R) for R in attitudes], attitudes, GRAVITY)
    assert load.mass == pytest.approx(MASS, rel=1e-12)
    np.testing.assert_allclose(load.centre_of_mass, CENTRE, rtol=0, atol=1e-12)
    np.testing.assert_allclose(load.bias, BIAS, rtol=0, atol=1e-12)
    assert max(load.left_over) < 1e-12


def test_a_motion_gives_the_inertia_too():
    random = np.random.default_rng(4)
    attitudes = [exp(random.normal(size=3)) for _ in range(60)]
    motions = [tuple(random.normal(size=3) for _ in range(3)) for _ in attitudes]
    readings = [reading(R, motion) for R, motion in zip(attitudes, motions, strict=True)]
    load = identify_load(readings, attitudes, GRAVITY, motions)
    np.testing.assert_allclose(load.inertia, INERTIA, rtol=0, atol=1e-12)
    np.testing.assert_allclose(load.centre_of_mass, CENTRE, rtol=0, atol=1e-12)


def test_noise_and_attitude_errors_leave_little():
    """What is felt without contact afterwards, in other postures: 95 of 100 times."""
    random = np.random.default_rng(7)
    true, left = tilted(np.deg2rad(60.0)), []
    sigma = np.array([2.5e-3] * 3 + [0.03] * 3)
    for _ in range(200):
        error = exp(np.deg2rad(0.1) * random.normal(size=3) / np.sqrt(3.0))
        readings = [reading(R) + sigma * random.normal(size=6) / 10.0 for R in true]
        load = identify_load(readings, [error @ R for R in true], GRAVITY)
        numbers = np.zeros(16)
        numbers[[0, 1, 2, 3]] = load.mass, *(load.mass * load.centre_of_mass)
        numbers[10:] = load.bias
        rest = [
            reading(R) - load_regressor(error @ R, *AT_REST, GRAVITY) @ numbers
            for R in tilted(np.deg2rad(40.0), 5)
        ]
        left.append(np.abs(rest).max(axis=0))
    moment, force = np.percentile(left, 95, axis=0).reshape(2, 3).max(axis=1)
    assert force <= 0.05
    assert moment <= 5e-3


@pytest.mark.parametrize("attitudes", [tilted(np.deg2rad(5.0)), tilted(1.0)[:1], tilted(0.0)])
def test_postures_that_are_too_alike_are_refused_with_the_condition_number(attitudes):
    with pytest.raises(ConfigurationError, match=r"condition number is .*above 20"):
        identify_load([reading(R) for R in attitudes], attitudes, GRAVITY)


@pytest.mark.parametrize(
    ("readings", "motions", "words"),
    [
        (5, None, "5 readings, 6 attitudes; give"),
        (6, 3, "6 readings, 6 attitudes, 3 motions; give"),
        (6, 0, "6 readings, 6 attitudes, 0 motions; give"),
    ],
)
def test_each_posture_has_a_reading_and_a_motion(readings, motions, words):
    attitudes = tilted(1.0)
    moved = None if motions is None else [(np.zeros(3),) * 3] * motions
    with pytest.raises(ConfigurationError, match=words):
        identify_load([reading(R) for R in attitudes[:readings]], attitudes, GRAVITY, moved)


def test_no_posture_is_too_few():
    with pytest.raises(ConfigurationError, match="0 readings, 0 attitudes; give"):
        identify_load([], [], GRAVITY)
