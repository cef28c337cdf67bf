"""The controller of two arms called by hand does what it does in a diagram."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from allocations import allocations_of_ticks
from recorded_controller import Signals, record

from geoimp_drake.compilation.compiled import is_available
from geoimp_drake.controllers.cooperative_control_loop import CooperativeControlLoop
from geoimp_drake.diagrams.setups.tight_scenario import ARMS
from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.typing import Array

TICKS = 2000
# The object touches the surface within the second.
PRESS = {"segments": [{"duration": 1.0, "displacement": [0.0, 0.0, -0.275]}]}
BAR = {"load": {"mass": 5.0, "inertia": np.diag([0.4, 0.01, 0.4]).tolist()}}


@cache
def recorded() -> Signals:
    return record("bar", PRESS, BAR, arms=ARMS, ticks=TICKS)


def make(**options: Any) -> CooperativeControlLoop:
    was = recorded()
    arms = [was.plant.GetModelInstanceByName(arm) for arm in ARMS]
    frames = [was.frame(arm, "grasp") for arm in ARMS]
    config = was.scenario.told(was.scenario.load)
    loads = [was.plant.GetModelInstanceByName("bar")]
    return CooperativeControlLoop(was.plant, arms, frames, config, loads=loads, **options)


def test_torques_are_those_of_the_diagram():
    was, loop = recorded(), make()
    torques = [loop.reset(*was.at(0)), *(loop.step(*was.at(k)) for k in range(1, TICKS))]
    assert np.ptp(was.wrench[0], axis=0).max() > 20.0  # something was felt
    for k in range(2):
        mine = [pair[k] for pair in torques]
        np.testing.assert_allclose(mine, was.torques[k][:TICKS], rtol=0, atol=1e-9)


@pytest.mark.skipif(not is_available(), reason="numba is not installed")
def test_laws_take_no_memory_in_a_tick():
    """Not for arrays from Python either, whose places the laws know."""
    was, loop = recorded(), make()
    loop.reset(*was.at(0))
    assert allocations_of_ticks(lambda k: loop.step(*was.at(k))) == 0


def test_a_saved_state_continues_to_the_bit():
    was, loop, again = recorded(), make(), make()
    loop.reset(*was.at(0))
    again.reset(*was.at(0))
    for k in range(1, 20):
        loop.step(*was.at(k))
    again.state[:] = loop.state.copy()
    for k in range(20, 40):
        np.testing.assert_array_equal(
            np.concatenate(again.step(*was.at(k))), np.concatenate(loop.step(*was.at(k)))
        )


def test_each_robot_has_its_own_order_of_joints():
    was, plain = recorded(), make()
    orders = [3, 0, 5, 6, 1, 4, 2], [5, 4, 0, 1, 3, 2]
    names = [
        [joints.names[k] for k in order] for joints, order in zip(plain.joints, orders, strict=True)
    ]
    loop = make(joints=names)

    def turned(values: list[Array]) -> list[Array]:
        return [value[order] for value, order in zip(values, orders, strict=True)]

    def given(k: int) -> tuple[Any, ...]:
        q, v, wrench, D = was.at(k)
        return turned(q), turned(v), wrench, D

    torques = [loop.reset(*given(0)), *(loop.step(*given(k)) for k in range(1, 20))]
    for k, order in enumerate(orders):
        mine = [pair[k] for pair in torques]
        np.testing.assert_allclose(mine, was.torques[k][:20, order], rtol=0, atol=1e-9)


def test_robots_that_hold_their_weight_are_given_torques_without_it():
    q, v, wrench, D = recorded().at(0)
    heavy, light = make(), make(gravity="robot")
    for k, (one, other) in enumerate(
        zip(heavy.reset(q, v, wrench, D), light.reset(q, v, wrench, D), strict=True)
    ):
        plant = heavy.models[k].plant
        context = plant.CreateDefaultContext()
        plant.SetPositions(context, q[k])
        weight = -plant.CalcGravityGeneralizedForces(context)
        assert abs(weight).max() > 100.0
        np.testing.assert_allclose(one - other, weight, rtol=0, atol=1e-9)
    with pytest.raises(ConfigurationError, match="controller, robot"):
        make(gravity="nobody")


def test_the_object_rests_where_the_hands_hold_it():
    q, v, *_ = recorded().at(0)
    loop = make()
    loop.reset(q, v)
    pose = loop.pose(q)
    np.testing.assert_allclose(pose.translation(), recorded().scenario.centre, rtol=0, atol=1e-6)
    np.testing.assert_allclose(
        loop.output("object_motion")[4:7], pose.translation(), rtol=0, atol=1e-12
    )
    np.testing.assert_allclose(loop.output("displacement"), 0.0, rtol=0, atol=1e-12)


@pytest.mark.parametrize("angle", np.deg2rad([-90.0, 90.0, 178.0, 179.5, 180.5, 182.0]))
def test_the_object_of_hands_that_face_each_other_is_that_of_the_start(angle):
    """By the sign of η alone it would be half a turn away."""
    (first, second), v, *_ = recorded().at(0)
    loop = make()
    q = [first, second + angle * np.eye(len(second))[-1]]
    loop.reset(q, v)
    expected = loop.output("object_motion")[:4]
    Q = loop.pose(q).rotation().ToQuaternion().wxyz()
    assert abs(Q @ expected) == pytest.approx(1.0, abs=1e-12)


def test_an_arm_whose_reading_cannot_be_used_is_named():
    q, v, wrench, D = recorded().at(0)
    loop = make()
    loop.reset(q, v, wrench, D)
    with pytest.raises(SignalError, match="6 joi"):
        loop.step([q[0], q[1][:5]], v, wrench, D)
    with pytest.raises(SignalError, match="wrench_2' got 5"):
        loop.step(q, v, [wrench[0], wrench[1][:5]], D)
