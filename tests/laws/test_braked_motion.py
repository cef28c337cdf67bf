"""A frame brakes without a jump, and rests where the polynomial says."""

import numpy as np
import pytest

from geoimp_drake.laws.braked_motion import braked_motion
from geoimp_drake.laws.frame_motion import (
    ACCELERATION,
    ANGULAR_VELOCITY,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
    VELOCITY,
)
from geoimp_drake.rotations import quaternion

DURATION = 0.15


def moving() -> np.ndarray:
    motion = np.zeros(19)
    motion[QUATERNION] = quaternion.exp(np.array([0.3, -0.2, 0.5]))
    motion[POSITION] = [0.4, -0.1, 0.7]
    motion[ANGULAR_VELOCITY], motion[LINEAR_VELOCITY] = [0.2, -0.4, 0.6], [0.3, 0.1, -0.2]
    motion[ACCELERATION] = [0.5, -1.0, 1.5, 1.0, -2.0, 0.5]
    return motion


def test_it_begins_as_the_frame_moves_and_ends_at_rest():
    start = moving()
    np.testing.assert_allclose(braked_motion(0.0, DURATION, start), start, rtol=0, atol=1e-15)
    for time in (DURATION, 2.0 * DURATION):
        end = braked_motion(time, DURATION, start)
        np.testing.assert_allclose(end[VELOCITY], 0.0, atol=1e-14)
        np.testing.assert_allclose(end[ACCELERATION], 0.0, atol=1e-12)
        way = start[LINEAR_VELOCITY] * DURATION / 2 + start[LINEAR_ACCELERATION] * DURATION**2 / 10
        np.testing.assert_allclose(end[POSITION] - start[POSITION], way, rtol=0, atol=1e-14)


@pytest.mark.parametrize("time", [0.01, 0.075, 0.14])
def test_velocities_and_accelerations_are_derivatives(time):
    step = 1e-5
    before, now, after = (
        braked_motion(t, DURATION, moving()) for t in (time - step, time, time + step)
    )
    v = (after[POSITION] - before[POSITION]) / (2 * step)
    turn = quaternion.product(after[QUATERNION], quaternion.conjugate(before[QUATERNION]))
    w = quaternion.log(turn) / (2 * step)
    np.testing.assert_allclose(np.concatenate((w, v)), now[VELOCITY], rtol=0, atol=1e-7)
    a = (after[VELOCITY] - before[VELOCITY]) / (2 * step)
    np.testing.assert_allclose(a, now[ACCELERATION], rtol=0, atol=1e-6)


def test_a_turn_of_d_across_its_axis_is_left_out_and_nothing_else():
    start = moving()
    start[13:16] += np.cross(start[ANGULAR_VELOCITY], [1.0, 0.0, 0.0])
    np.testing.assert_allclose(
        braked_motion(0.05, DURATION, start), braked_motion(0.05, DURATION, moving()), atol=1e-15
    )
