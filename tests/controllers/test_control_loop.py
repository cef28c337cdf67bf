"""The controller called by hand does what it does in a diagram, in the robot's order of joints."""

import tracemalloc
from copy import deepcopy
from functools import cache
from typing import Any

import numpy as np
import pytest
from allocations import allocations_of_ticks
from recorded_controller import Signals, record

from geoimp_drake.compilation.compiled import is_available
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.task_functions.task_function import NoTask
from geoimp_drake.typing import Array

TICKS = 2000


class Recorded:
    """The signals of one arm, and how they are given to a loop."""

    def __init__(self, signals: Signals):
        self.plant, self.scenario, self.desired = signals.plant, signals.scenario, signals.desired
        self.arm = signals.plant.GetModelInstanceByName(signals.scenario.arm)
        self.E = signals.frame(signals.scenario.arm)
        self.q, self.v, self.wrench = signals.q[0], signals.v[0], signals.wrench[0]
        self.torques = signals.torques[0]

    def loop(self, config: Any = None, **options: Any) -> ControlLoop:
        return ControlLoop(self.plant, self.arm, self.E, config or self.scenario, **options)

    def reset(self, loop: ControlLoop, order: Any = slice(None)) -> Array:
        return loop.reset(self.q[0][order], self.v[0][order], self.wrench[0], self.desired[0])

    def step(self, loop: ControlLoop, k: int, order: Any = slice(None), **more: Any) -> Array:
        signals = self.q[k][order], self.v[k][order], self.wrench[k], self.desired[k]
        return loop.step(*signals, **more)


PUSH = {"external": {"force": [10.0, -8.0, 6.0], "moment": [0.5, 0.3, -0.4], "start": 0.2}}
# The damping is the default, since natural inertia takes no other.
DIRECT = {
    "form": "blocks",
    "scheme": "direct",
    "impedance": {"translation": {"damping": 2000.0}, "rotation": {"damping": 5.0}},
}


@cache
def recorded(name: str) -> Recorded:
    """Records one arm while somebody pushes."""
    return Recorded(record(name, PUSH, ticks=TICKS))


@pytest.mark.parametrize("name", ["plexiglas", "redundancy"])
def test_torques_are_those_of_the_diagram(name):
    was = recorded(name)
    loop = was.loop()
    torques = [was.reset(loop), *(was.step(loop, k) for k in range(1, TICKS))]
    assert abs(was.wrench).max() > 1.0  # something was felt
    np.testing.assert_allclose(torques, was.torques[:TICKS], rtol=0, atol=1e-9)


@pytest.mark.parametrize("inertia", ["desired", "natural"])
def test_torques_of_a_direct_impedance_are_those_of_the_diagram(inertia):
    """Natural inertia does not need to know the push."""
    was = Recorded(record("disturbance", PUSH, DIRECT, {"inertia": inertia}, ticks=400))
    loop = was.loop()
    torques = [was.reset(loop), *(was.step(loop, k) for k in range(1, 400))]
    assert abs(was.wrench).max() > 1.0
    np.testing.assert_allclose(torques, was.torques[:400], rtol=0, atol=1e-9)
    if inertia == "natural":
        was.wrench[:] = np.nan
        blind = [was.reset(loop), *(was.step(loop, k) for k in range(1, 400))]
        np.testing.assert_array_equal(blind, torques)


def test_a_saved_state_continues_to_the_bit():
    was = recorded("redundancy")
    loop, again = was.loop(), was.loop()
    was.reset(loop)
    was.reset(again)
    for k in range(1, 100):
        was.step(loop, k)
    again.state[:] = loop.state.copy()
    for k in range(100, 200):
        np.testing.assert_array_equal(was.step(again, k), was.step(loop, k))


def test_memory_does_not_grow_from_tick_to_tick():
    was = recorded("plexiglas")
    loop = was.loop()
    was.reset(loop)
    for k in range(1, 200):
        was.step(loop, k)
    tracemalloc.start()
    try:
        was.step(loop, 200)
        before, _ = tracemalloc.get_traced_memory()
        tracemalloc.reset_peak()
        for _ in range(10_000):
            was.step(loop, 200)
        after, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    # A tick's own small arrays come and go; no more than those are there at any time.
    assert after - before < 1000
    assert peak - before < 10_000


@pytest.mark.skipif(not is_available(), reason="numba is not installed")
@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("plexiglas", {}),
        ("plexiglas", {"config": ImpedanceControllerConfig(scheme="direct")}),
        ("redundancy", {"task_function": NoTask()}),
        ("redundancy", {"config": ImpedanceControllerConfig()}),  # goes back to its posture
    ],
    ids=["six joints", "direct", "seven joints", "posture"],
)
def test_laws_take_no_memory_in_a_tick(name, options):
    """Not for arrays from Python either, whose places the laws know."""
    was = recorded(name)
    loop = was.loop(**options)
    was.reset(loop)
    assert allocations_of_ticks(lambda k: was.step(loop, k)) == 0


def test_joints_may_be_in_the_robots_own_order():
    was = recorded("plexiglas")
    names = was.loop().joints.names
    order = [3, 0, 5, 1, 4, 2]
    loop = was.loop(joints=[names[k] for k in order])
    torques = [was.reset(loop, order), *(was.step(loop, k, order) for k in range(1, 50))]
    np.testing.assert_allclose(torques, was.torques[:50, order], rtol=0, atol=1e-9)
    limits = was.loop().joints.effort_limits
    np.testing.assert_array_equal(loop.joints.effort_limits, limits[order])


def test_a_robot_that_holds_its_weight_is_given_torques_without_it():
    was = recorded("plexiglas")
    heavy, light = was.loop(), was.loop(gravity="robot")
    difference = was.reset(heavy) - was.reset(light)
    plant, context = heavy.model.plant, heavy.model.plant.CreateDefaultContext()
    plant.SetPositions(context, was.q[0])
    weight = -plant.CalcGravityGeneralizedForces(context)
    assert abs(weight).max() > 100.0
    np.testing.assert_allclose(difference, weight, rtol=0, atol=1e-9)


def test_lost_messages_are_made_up_for_by_the_time_that_passed():
    """Every third tick alone, told the time between, C comes to the same place."""
    was = recorded("plexiglas")
    each, third = was.loop(), was.loop()
    was.reset(each)
    was.reset(third)
    for k in range(1, 1801):
        was.step(each, k)
        if k % 3 == 0:
            was.step(third, k, dt=3e-3)
    C, v = (
        [loop.output(name).copy() for loop in (each, third)]
        for name in ("compliant_motion", "measured_motion")
    )
    moved = np.linalg.norm(was.desired[1800, 4:7] - was.desired[0, 4:7])
    assert moved > 0.02
    np.testing.assert_allclose(C[1][:7], C[0][:7], rtol=0, atol=1e-2 * moved)
    # Velocities are differences of positions, over the time between messages.
    assert was.scenario.sampling.velocity == "differenced"
    speed = np.linalg.norm(v[0][10:13])
    assert speed > 0.01
    np.testing.assert_allclose(v[1][10:13], v[0][10:13], rtol=0, atol=0.05 * speed)


def test_a_gap_longer_than_the_impedance_bears_is_made_up_for():
    """M/D is 4.5 ms: one Euler step of 20 ms would multiply a velocity of C by −3.4."""
    was = recorded("plexiglas")
    config = deepcopy(was.scenario)
    config.impedance.translation.mass = np.array(9.0)
    config.impedance.translation.damping = np.array(2000.0)
    loops = [ControlLoop(was.plant, was.arm, was.E, config) for _ in range(2)]
    for loop in loops:
        was.reset(loop)
    for k in range(1, 1001):
        was.step(loops[0], k)
        if k % 20 == 0:
            was.step(loops[1], k, dt=20e-3)
    C, sparse = (loop.output("compliant_motion")[4:7] for loop in loops)
    assert np.linalg.norm(C - sparse) < 3e-4


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda was, loop: loop.step(was.q[0][:5], was.v[0], np.zeros(6), was.desired[0]), "6 joi"),
        (lambda was, loop: loop.step(was.q[0], was.v[0], np.zeros(5), was.desired[0]), "takes 6"),
        (
            lambda was, loop: loop.step(was.q[0] * np.nan, was.v[0], np.zeros(6), was.desired[0]),
            "nan",
        ),
        (lambda was, loop: was.step(loop, 1, dt=-1e-3), "-0.001 s"),
        (lambda was, loop: was.step(loop, 1, dt=float("nan")), "nan s"),
        (lambda was, loop: was.step(loop, 1, dt=2.0), "after more than 1 s, reset"),
    ],
)
def test_a_signal_that_cannot_be_used_is_named(call, words):
    was = recorded("plexiglas")
    loop = was.loop()
    was.reset(loop)
    with pytest.raises(SignalError, match=words):
        call(was, loop)


def test_what_the_robot_is_not_is_refused():
    was = recorded("plexiglas")
    names = was.loop().joints.names
    with pytest.raises(ConfigurationError, match="waist, waist"):
        was.loop(joints=[names[0], *names[:5]])
    with pytest.raises(ConfigurationError, match="controller, robot"):
        was.loop(gravity="nobody")
    with pytest.raises(ConfigurationError, match="compliant_motion"):
        was.loop().output("compliant")
