"""The trapezoidal speed profile."""

import numpy as np
import pytest

from geoimp_drake.motion_program.speed_profile import trapezoidal_profile

LONG, SHORT, JUST = (0.5, 2.0), (3.0, 2.0), (2.0, 4.0)
every_case = pytest.mark.parametrize(("speed", "acceleration"), [LONG, SHORT, JUST, (1e-3, 1e2)])


def sampled(profile, order: int, count: int = 2001) -> np.ndarray:
    times = np.linspace(profile.start_time(), profile.end_time(), count)
    return np.array([profile.EvalDerivative(t, order)[0, 0] for t in times])


@every_case
def test_path_is_covered_once_from_rest_to_rest(speed, acceleration):
    s, rate = (sampled(trapezoidal_profile(2.5, speed, acceleration), k) for k in (0, 1))
    np.testing.assert_allclose(s[[0, -1]], [0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(rate[[0, -1]], 0.0, atol=1e-9)
    assert (np.diff(s) > 0).all()


@every_case
def test_speed_and_acceleration_keep_their_bounds_and_reach_one(speed, acceleration):
    profile = trapezoidal_profile(0.0, speed, acceleration)
    rate, change = (np.abs(sampled(profile, k)).max() for k in (1, 2))
    assert rate == pytest.approx(min(speed, np.sqrt(acceleration)), rel=1e-3)
    assert change == pytest.approx(acceleration, rel=1e-6)


@every_case
def test_speed_has_no_jumps(speed, acceleration):
    profile = trapezoidal_profile(0.0, speed, acceleration)
    step = profile.end_time() / 2000
    assert np.abs(np.diff(sampled(profile, 1))).max() <= acceleration * step * (1 + 1e-6)


def test_duration_is_that_of_the_trapezoid_or_of_the_triangle():
    assert trapezoidal_profile(1.0, *LONG).end_time() == pytest.approx(1.0 + 2.0 + 0.25)
    assert trapezoidal_profile(1.0, *SHORT).end_time() == pytest.approx(1.0 + 2.0 / np.sqrt(2.0))
