"""A tick in one compiled call does what the pieces do one after the other, to the bit."""

import functools
from typing import Any

import numpy as np
import pytest
from arms import make_arm_plant

from geoimp_drake.compilation.compiled import is_available
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.errors import SignalError
from geoimp_drake.parts import impedance_tick
from geoimp_drake.parts.impedance_controller import ImpedanceController
from geoimp_drake.systems.frame_motion import frame_motion_at_rest
from geoimp_drake.typing import Array

TICKS = 300
JERK = range(100, 105)  # when the arm is moved faster than it may
OUTPUTS = ("compliant_motion", "last_compliant_motion", "energy", "peak_effort", "displacement")


class Both:
    """The same loop twice: in one call where that is possible, and in pieces."""

    def __init__(self, monkeypatch: Any, limits: bool = True, velocity: str = "differenced"):
        rig, config = make_arm_plant(joints=6), ImpedanceControllerConfig()
        config.sampling.velocity = velocity
        if not limits:
            config.limits = None

        def make() -> ControlLoop:
            return ControlLoop(rig.plant, rig.arm, rig.E, config)

        self.at_once, self.posture = make(), rig.posture
        with monkeypatch.context() as patched:
            patched.setattr(ImpedanceController, "_tick", lambda *_: None)
            self.in_pieces = make()
        self.loops = self.at_once, self.in_pieces
        self.D = frame_motion_at_rest(self.at_once.pose(self.posture))
        self.done = 0
        tick: Any = self.at_once._loop._now
        own = tick._tick

        def counted(*arguments: Any) -> bool:
            done: bool = own(*arguments)
            self.done += done
            return done

        tick._tick = counted

    def signals(self, k: int) -> tuple[Array, Array, Array, Array]:
        """Returns q, v, wrench and D."""
        phase, D = 2e-3 * np.pi * k, self.D.copy()
        D[4] += 0.02 * np.sin(phase)
        h = np.array([0.1, 0.2, -0.1, 5.0, -3.0, 4.0]) * np.sin(3 * phase)
        q, v = self.posture + 0.01 * np.sin(phase), np.full(6, 0.02 * np.pi * np.cos(phase))
        if k in JERK:
            q, v = q + 0.01 * (k - JERK.start), v + 10.0
        return q, v, h, D

    def reset(self) -> None:
        for loop in self.loops:
            q, v, h, D = self.signals(0)
            loop.reset(q, v, h, D)

    def step(self, k: int) -> tuple[Array, Array]:
        dt = {0: 2.5e-3, 3: 0.4e-3}.get(k % 7)
        first, second = (loop.step(*self.signals(k), dt=dt) for loop in self.loops)
        return first, second


def warnings_of(caplog: Any) -> list[str]:
    return [record.getMessage() for record in caplog.records if "control_loop" in record.message]


@pytest.mark.parametrize(
    ("limits", "says", "least"), [(True, "reaches", 150), (False, "saturates", 250)]
)
@pytest.mark.parametrize("velocity", ["measured", "differenced"])
def test_torques_state_and_outputs_are_those_of_the_pieces(
    monkeypatch, caplog, limits, says, least, velocity
):
    """Also where a limit begins and ceases to act, ticks are lost, or come early."""
    both = Both(monkeypatch, limits, velocity)
    both.reset()
    for k in range(1, TICKS):
        np.testing.assert_array_equal(*both.step(k))
        np.testing.assert_array_equal(*(loop.state for loop in both.loops))
        for name in OUTPUTS:
            np.testing.assert_array_equal(*(loop.output(name) for loop in both.loops))
    said = warnings_of(caplog)
    assert said
    assert all(says in text for text in said)
    assert all(said.count(text) == 2 for text in said)
    # Of seven ticks one is longer than a period; while a limit acts there are pieces, too.
    assert least < both.done <= TICKS - TICKS // 7


@pytest.mark.skipif(not is_available(), reason="numba is not installed")
def test_the_law_as_written_gives_the_same_numbers(monkeypatch):
    monkeypatch.setattr(impedance_tick, "bound", functools.partial)
    both = Both(monkeypatch)
    both.reset()
    for k in range(1, 7):
        first, second = both.step(k)
        np.testing.assert_allclose(first, second, rtol=1e-9, atol=1e-9)
    assert both.done == 6


@pytest.mark.parametrize("spoilt", range(4), ids=["q", "v", "wrench", "D"])
def test_a_signal_that_cannot_be_used_moves_nothing_that_the_pieces_would_not(monkeypatch, spoilt):
    both = Both(monkeypatch)
    both.reset()
    both.step(1)
    said = []
    for loop in both.loops:
        signals = both.signals(2)
        signals[spoilt][3] = np.nan
        with pytest.raises(SignalError) as error:
            loop.step(*signals)
        said.append(str(error.value))
    assert said[0] == said[1]
    np.testing.assert_array_equal(*(loop.state for loop in both.loops))
    both.reset()
    np.testing.assert_array_equal(*both.step(1))


def test_gains_that_change_are_followed_in_pieces(monkeypatch):
    """A loop that is given factors of the stiffness is not moved by the configured one."""
    both = Both(monkeypatch)
    given: list[Array] = []
    for loop in both.loops:
        q, v, h, D = both.signals(0)
        inputs = {"wrench": h, "desired_motion": D, "stiffness_scale": np.array([0.5, 0.5])}
        part: Any = loop._loop
        part.reset({"estimated_state": np.concatenate((q, v)), **inputs})
        given += [loop.step(*both.signals(k)) for k in range(1, 4)]
    np.testing.assert_array_equal(given[:3], given[3:])
    assert both.done == 0
