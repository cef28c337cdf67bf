"""An opened grasp is noticed, a load that goes through zero is not; then the hands come to rest."""

import logging

import numpy as np
import pytest
from hand_motions import same_rotation
from signal_sources import Rig, Signal

from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.parts.grasp_watch import GraspMonitorConfig
from geoimp_drake.parts.reference_hold import AFTER_HOLD, ReferenceHoldConfig
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.cooperation.grasp_monitor import GraspMonitor
from geoimp_drake.systems.cooperation.reference_hold import ReferenceHold
from geoimp_drake.systems.frame_motion import (
    ANGULAR_VELOCITY,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
    VELOCITY,
)

CARRIED = np.array([0.5, 0.2, -0.3, 2.0, -1.0, 64.0])
OPEN_AT = 0.1


def opening(time: float = OPEN_AT, fall: float = 0.003, noise: float = 0.2) -> Signal:
    """A wrench that falls to the noise of a sensor within a few samples."""
    rng = np.random.default_rng(0)
    samples = noise * rng.normal(size=(2000, 6)) * np.array([0.05] * 3 + [1.0] * 3)

    def wrench(t: float) -> np.ndarray:
        left = 1.0 - min(max((t - time) / fall, 0.0), 1.0)
        return left * CARRIED + samples[round(t * 1000)]

    return wrench


def passing_through_zero(rate: float) -> Signal:
    """A weight that a contact takes over: 20 N to −20 N at `rate` [N/s], no moment."""

    def wrench(t: float) -> np.ndarray:
        return np.array([0.0, 0.0, 0.0, 0.0, 0.0, np.clip(20.0 - rate * t, -20.0, 20.0)])

    return wrench


def opened(first: Signal | np.ndarray, second: Signal | np.ndarray, until: float = 0.2, **config):
    monitor = GraspMonitor(GraspMonitorConfig(**config))
    return Rig(monitor, {"wrench_1": first, "wrench_2": second}).advance(until).read("opened")


@pytest.mark.parametrize("fall", [0.0005, 0.003, 0.004])
@pytest.mark.parametrize("hand", [0, 1])
def test_opened_grasp_is_noticed_within_20_ms(hand: int, fall: float) -> None:
    wrenches = [CARRIED, CARRIED]
    wrenches[hand] = opening(fall=fall)
    flags = opened(*wrenches)
    assert flags[hand] == 1.0
    assert flags[1 - hand] == 0.0
    assert 0.0 < flags[2] - OPEN_AT < 0.020


def test_it_is_said_once_on_the_terminal_with_hand_and_time(caplog) -> None:
    with caplog.at_level(logging.WARNING, logger="drake"):
        flags = opened(CARRIED, opening())
    (record,) = caplog.records
    assert "the grasp of the second hand has opened" in record.message
    assert f"t = {flags[2]:.3f} s" in record.message


@pytest.mark.parametrize("rate", [50.0, *np.geomspace(300.0, 6000.0, 25)])
def test_force_that_passes_through_zero_is_no_opened_grasp_at_any_rate(rate: float) -> None:
    flags = opened(passing_through_zero(rate), CARRIED, 40.0 / rate + 0.03)
    np.testing.assert_array_equal(flags, [0.0, 0.0, -1.0])


def test_load_that_stays_at_zero_after_a_slow_fall_is_none_either() -> None:
    flags = opened(opening(fall=0.1), CARRIED, 0.5)
    np.testing.assert_array_equal(flags, [0.0, 0.0, -1.0])


def test_short_loss_of_contact_is_no_opened_grasp() -> None:
    def bounce(t: float) -> np.ndarray:
        return CARRIED * (not 0.1 <= t < 0.109)

    np.testing.assert_array_equal(opened(bounce, CARRIED), [0.0, 0.0, -1.0])
    assert opened(bounce, CARRIED, dwell=0.005, fall_time=0.002)[0] == 1.0


def test_hand_that_carries_nothing_is_never_reported() -> None:
    """It cannot be told from an open one."""
    light = 0.1 * CARRIED
    flags = opened(lambda t: light * (t < 0.1), np.zeros(6))
    np.testing.assert_array_equal(flags, [0.0, 0.0, -1.0])


def test_moment_alone_is_a_load() -> None:
    bending = np.array([6.0, 0, 0, 0, 0, 0])
    assert opened(lambda t: bending * (t < 0.1), CARRIED)[0] == 1.0
    np.testing.assert_array_equal(opened(bending, CARRIED)[:2], [0.0, 0.0])


def test_report_is_kept_when_the_load_comes_back_and_forgotten_by_initialization() -> None:
    signals = {"wrench_1": CARRIED, "wrench_2": lambda t: CARRIED * (not 0.05 < t < 0.1)}
    rig = Rig(GraspMonitor(), signals).advance(0.15)
    clone = rig.simulator.get_context().Clone()
    assert rig.read("opened")[1] == 1.0
    rig.simulator.Initialize()
    np.testing.assert_array_equal(rig.read("opened"), [0.0, 0.0, -1.0])
    assert rig.read("opened", clone)[1] == 1.0


def test_second_grasp_may_open_later_and_the_time_is_that_of_the_first() -> None:
    flags = opened(opening(0.05), opening(0.12))
    np.testing.assert_array_equal(flags[:2], [1.0, 1.0])
    assert flags[2] < 0.07


def test_bad_thresholds_and_signals_are_named() -> None:
    for config, text in (
        (GraspMonitorConfig(force_threshold=0.0), r"monitor\.force_threshold is 0 N"),
        (GraspMonitorConfig(loaded=1.0), r"monitor\.loaded"),
        (GraspMonitorConfig(dwell=np.nan), r"monitor\.dwell"),
        (GraspMonitorConfig(dwell=0.005), "passes through zero evenly"),
        (GraspMonitorConfig(fall_time=1e-4), "no fall is that fast"),
    ):
        with pytest.raises(ConfigurationError, match=text):
            GraspMonitor(config)
    with pytest.raises(SignalError, match="Port 'system:wrench_2' got"):
        opened(CARRIED, np.full(6, np.nan))


def moving(p: np.ndarray) -> Signal:
    """A hand that moves at 0.3 m/s and turns at 1 rad/s."""
    w, v = np.array([0.0, 0.6, 0.8]), np.array([0.0, 0.0, -0.3])

    def motion(t: float) -> np.ndarray:
        value = np.zeros(19)
        value[QUATERNION] = quaternion.exp(w * t)
        value[POSITION], value[ANGULAR_VELOCITY], value[LINEAR_VELOCITY] = p + v * t, w, v
        return value

    return motion


HANDS = moving(np.array([0.0, -0.5, 0.8])), moving(np.array([0.0, 0.5, 0.8]))


def held(time: float, config: ReferenceHoldConfig | None = None, hand: int = 1) -> Rig:
    """A hold whose hand opens at 0.1 s."""
    flags = np.array([float(hand == 0), float(hand == 1), 0.1])
    signals = {
        "reference_motion_1": HANDS[0],
        "reference_motion_2": HANDS[1],
        "opened": lambda t: flags if t > 0.0995 else np.array([0.0, 0.0, -1.0]),
    }
    return Rig(ReferenceHold(config), signals).advance(time)


def test_references_pass_until_a_grasp_opens() -> None:
    rig = held(0.0985)
    for k in range(2):
        np.testing.assert_array_equal(rig.read(f"held_motion_{k + 1}"), HANDS[k](0.0985))
    np.testing.assert_array_equal(rig.read("release"), [0.0, 0.0])


@pytest.mark.parametrize("after", AFTER_HOLD)
def test_hands_come_to_rest_smoothly_near_where_they_were(after: str) -> None:
    config = ReferenceHoldConfig(after)
    rig = held(0.1, config)
    before = [rig.read(f"held_motion_{k}") for k in (1, 2)]
    last, motions = before, []
    for step in range(1, 101):
        rig.advance(0.1 + step * 1e-3)
        now = [rig.read(f"held_motion_{k}") for k in (1, 2)]
        for a, b in zip(last, now, strict=True):
            # Velocities are those of the poses, and do not jump.
            mean = 0.5 * (a + b)[VELOCITY]
            np.testing.assert_allclose((b - a)[POSITION], mean[3:] * 1e-3, atol=2e-6)
            turn = quaternion.log(
                quaternion.product(b[QUATERNION], quaternion.conjugate(a[QUATERNION]))
            )
            np.testing.assert_allclose(turn, mean[:3] * 1e-3, atol=5e-6)
            assert np.abs((b - a)[VELOCITY]).max() < 0.06
        last = now
        motions.append(now)
    for start, at_50_ms, end in zip(before, motions[50], last, strict=True):
        assert np.linalg.norm(at_50_ms[LINEAR_VELOCITY]) < 0.09 * 0.3
        np.testing.assert_allclose(end[VELOCITY], 0.0, atol=0.01)
        np.testing.assert_allclose(end[POSITION], start[POSITION], atol=0.0065)
        assert same_rotation(end[QUATERNION], start[QUATERNION]) < 0.011


def test_hold_stays_and_says_nothing_to_the_grippers() -> None:
    rig = held(0.9)
    at_rest = rig.read("held_motion_1")
    rig.advance(3.0)
    np.testing.assert_allclose(rig.read("held_motion_1")[:7], at_rest[:7], atol=1e-9)
    np.testing.assert_array_equal(rig.read("release"), [0.0, 0.0])


def test_release_asks_the_hand_that_still_holds_to_open_after_the_delay() -> None:
    rig = held(0.1 + 0.19, ReferenceHoldConfig("release", delay=0.2))
    np.testing.assert_array_equal(rig.read("release"), [0.0, 0.0])
    np.testing.assert_array_equal(rig.advance(0.31).read("release"), [1.0, 0.0])


@pytest.mark.parametrize("hand", [0, 1])
def test_retreat_draws_the_opened_hand_back_from_the_other(hand: int) -> None:
    config = ReferenceHoldConfig("retreat", 0.01, 0.2, 0.05, 0.5)
    rig = held(0.25, config, hand)
    before = [rig.read(f"held_motion_{k}")[POSITION] for k in (1, 2)]
    fastest = 0.0
    for time in np.arange(0.26, 1.0, 0.02):
        rig.advance(time)
        fastest = max(fastest, rig.read(f"held_motion_{hand + 1}")[LINEAR_VELOCITY][1], key=abs)
    after = [rig.read(f"held_motion_{k}")[POSITION] for k in (1, 2)]
    way = 0.05 if hand else -0.05
    np.testing.assert_allclose(after[hand] - before[hand], [0.0, way, 0.0], atol=1e-5)
    np.testing.assert_allclose(after[1 - hand], before[1 - hand], atol=1e-5)
    np.testing.assert_allclose(fastest, 1.875 * way / 0.5, rtol=0.01)


def test_bad_hold_is_named() -> None:
    for config, text in (
        (ReferenceHoldConfig("drop"), "Valid: hold, release, retreat"),
        (ReferenceHoldConfig(stop_time=0.0), r"opened\.stop_time"),
        (ReferenceHoldConfig(delay=-1.0), r"opened\.delay"),
    ):
        with pytest.raises(ConfigurationError, match=text):
            ReferenceHold(config)
