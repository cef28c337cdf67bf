"""Signals that go wrong while an arm presses: supervised it brakes and holds, else it says so."""

import numpy as np
import pytest
from supervised_arm import MOVE, Changes, Run, run_arm

from geoimp_drake.errors import SignalError
from geoimp_drake.laws.frame_motion import LINEAR_VELOCITY, POSITION
from geoimp_drake.systems.sources.desired_motion import MotionSegment
from geoimp_drake.systems.supervisor import Mode

BEGIN = 0.6  # when it happens: the hand presses with 42.6 N, D moves at 0.094 m/s
PRESS = MotionSegment(1.2, [0.0, 0.0, -0.06])
SAMPLE, LONG = 1e-3, 0.05
BRAKED = [Mode.RUN, Mode.HOLD, Mode.BRAKE, Mode.STOPPED]

# Undisturbed the hand presses with 44.2 N at most, and asks for 0.118 of a joint's limit.
LARGEST_FORCE, LARGEST_TORQUE = 46.0, 0.15


def pressed(changes: Changes) -> Run:
    """Runs an arm that presses on a spring of 5000 N/m, 10 mm below the hand."""
    return run_arm(changes, move=PRESS, wall=0.01, duration=1.3)


def during(duration: float, change):
    """Returns what changes a signal for a while."""

    def changed(t: float, value: np.ndarray) -> np.ndarray:
        return change(value) if BEGIN - 1e-9 <= t < BEGIN + duration - 1e-9 else value

    return changed


def not_a_number(value: np.ndarray) -> np.ndarray:
    return np.full_like(value, np.nan)


def spiked(wrench: np.ndarray) -> np.ndarray:
    return wrench - [0.0, 0.0, 0.0, 0.0, 0.0, 500.0]


def stuck(duration: float):
    """Returns what keeps a signal as it was when that began."""
    kept: list[np.ndarray] = []

    def keep(value: np.ndarray) -> np.ndarray:
        kept.append(value)
        return kept[0].copy()

    return during(duration, keep)


def missing(t: float) -> np.ndarray:
    return during(LONG, np.zeros_like)(t, np.ones(1))


def jumped(t: float, D: np.ndarray) -> np.ndarray:
    if t >= BEGIN - 1e-9:
        D[POSITION] += [0.1, 0.0, 0.0]
    return D


def modes_of(run: Run) -> list[Mode]:
    """Returns the modes from RUN on."""
    modes = run.mode[150:]
    return [Mode(int(mode)) for mode in modes[np.diff(modes, prepend=-1.0) != 0]]


HURT = {
    "NaN wrench": (Changes(wrench=during(LONG, not_a_number)), "no valid wrench for 20 ms, D is C"),
    "no wrench any more": (Changes(wrench=during(9.0, not_a_number)), "20 ms, D is C"),
    "NaN reading": (Changes(state=during(LONG, not_a_number)), "no valid reading for 20 ms"),
    "spike": (Changes(wrench=during(SAMPLE, spiked)), "force 543 N exceeds 100"),
    "stuck wrench": (Changes(wrench=stuck(LONG)), "no valid wrench for 20 ms, D is C"),
    "stuck reading": (Changes(state=stuck(LONG)), "no new reading for 20 ms"),
    "missing reading": (Changes(valid=missing), "no valid reading for 20 ms"),
    "D jumps": (Changes(D=jumped), "desired step 0.1 m exceeds 0.01"),
}


@pytest.mark.parametrize("name", HURT)
def test_a_supervised_arm_brakes_and_holds(name, caplog):
    changes, reason = HURT[name]
    run = pressed(changes)
    assert reason in caplog.text
    is_at_once = name in ("spike", "D jumps")
    assert modes_of(run) == ([Mode.RUN, *BRAKED[2:]] if is_at_once else BRAKED)
    assert run.force[:600].max() == pytest.approx(42.6, abs=0.5)
    assert run.force.max() < LARGEST_FORCE
    assert (np.abs(run.torque) / run.effort_limits).max() < LARGEST_TORQUE
    assert np.abs(np.diff(run.torque, axis=0)).max() <= 1.0 + 1e-9
    assert np.linalg.norm(run.E[-1, LINEAR_VELOCITY]) < 5e-3
    np.testing.assert_array_equal(run.D[-1, LINEAR_VELOCITY], 0.0)


@pytest.mark.parametrize(
    "changes",
    [
        Changes(wrench=during(SAMPLE, not_a_number)),
        Changes(state=during(SAMPLE, not_a_number)),
    ],
    ids=["wrench", "reading"],
)
def test_one_sample_that_is_none_is_bridged(changes):
    run = pressed(changes)
    assert modes_of(run) == [Mode.RUN, Mode.HOLD, Mode.RUN]
    assert run.force.max() == pytest.approx(44.2, abs=0.5)


@pytest.mark.parametrize(
    ("changes", "port"),
    [
        (Changes(wrench=during(SAMPLE, not_a_number)), "impedance:wrench"),
        (Changes(state=during(SAMPLE, not_a_number)), "joint_readings:state"),
    ],
    ids=["wrench", "reading"],
)
def test_without_a_supervisor_the_error_names_the_port(changes, port):
    with pytest.raises(SignalError, match=rf"Port '{port}' got .*every entry must be finite"):
        run_arm(changes, duration=0.7, is_supervised=False)


def test_a_wrench_of_zero_and_an_arm_at_rest_are_not_stuck():
    run = run_arm(Changes(), move=MOVE, duration=1.2)
    assert modes_of(run) == [Mode.RUN]
