"""The supervisor before and behind a controller in a diagram brakes the arm, and tells why."""

from collections.abc import Callable

import numpy as np
import pytest
from signal_sources import constant
from supervised_arm import Change, Changes, Run, run_arm, unchanged

from geoimp_drake.laws.frame_motion import LINEAR_VELOCITY, POSITION
from geoimp_drake.systems.supervisor import Mode

BEGIN = 0.3  # when something happens [s]


def supervised(change_D: Change, wrench: Callable[[float], np.ndarray]) -> Run:
    """Runs a moving arm for 0.6 s; the wrench is what a sensor says, nobody pushes."""
    return run_arm(Changes(D=change_D, wrench=lambda t, h: wrench(t)))


def jumped(t: float, D: np.ndarray) -> np.ndarray:
    if t >= BEGIN - 1e-9:
        D[POSITION] += [0.1, 0.0, 0.0]
    return D


def faster(t: float, D: np.ndarray) -> np.ndarray:
    if t >= BEGIN - 1e-9:
        D[LINEAR_VELOCITY] += [0.0, 0.5, 0.0]
    return D


def hit(t: float) -> np.ndarray:
    struck = BEGIN - 1e-9 <= t < BEGIN + 4e-3
    return np.array([0.0, 0.0, 0.0, 0.0, 150.0 if struck else 0.0, 0.0])


@pytest.mark.parametrize(
    ("change_D", "wrench", "reason"),
    [
        (jumped, constant(np.zeros(6)), "desired step 0.1 m exceeds 0.01"),
        (faster, constant(np.zeros(6)), "desired speed step 0.5 m/s exceeds 0.02"),
        (unchanged, hit, "force 150 N exceeds 100"),
    ],
    ids=["D jumps", "D's velocity jumps", "hit"],
)
def test_an_arm_is_braked_for_what_exceeds_its_limit(change_D, wrench, reason, caplog):
    run = supervised(change_D, wrench)
    assert reason in caplog.text
    first = np.flatnonzero(run.mode == Mode.BRAKE)[0]
    assert first == pytest.approx(round(BEGIN * 1e3), abs=2)
    assert [Mode(int(m)) for m in run.mode[[50, 200, -1]]] == [
        Mode.SOFT_START,
        Mode.RUN,
        Mode.STOPPED,
    ]
    # The controller never sees the jump; D comes to rest where its motion leads it.
    speed = np.linalg.norm(run.D[first - 5, LINEAR_VELOCITY])
    assert speed > 0.1
    assert np.abs(np.diff(run.D[:, POSITION], axis=0)).max() < 1.1e-3 * speed * 1.5
    assert np.linalg.norm(run.D[-1, POSITION] - run.D[first, POSITION]) < 0.15 * speed
    assert np.linalg.norm(run.E[-1, LINEAR_VELOCITY]) < 2e-3
    assert np.linalg.norm(run.E[-1, POSITION] - run.D[-1, POSITION]) < 2e-3
    assert np.abs(np.diff(run.torque, axis=0)).max() <= 1.0 + 1e-9
    np.testing.assert_array_equal(run.D[-1, LINEAR_VELOCITY], 0.0)


def test_nothing_happens_to_an_arm_within_its_limits():
    run = supervised(unchanged, constant(np.zeros(6)))
    assert run.mode[-1] == Mode.RUN
    assert np.linalg.norm(run.E[-1, POSITION] - run.D[-1, POSITION]) < 1e-4
