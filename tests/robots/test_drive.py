"""An arm behind a robot's interface starts, follows, bridges gaps, and always ends at rest."""

import os
import signal
import time
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from driven_arm import STIFFNESS, Between, DrivenArm

from geoimp_drake.compilation import compiled
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.frame_motion import LINEAR_VELOCITY, POSITION
from geoimp_drake.parts.supervisor import Mode, SupervisorConfig, SupervisorLimits
from geoimp_drake.robots.drive import Drive, DriveConfig
from geoimp_drake.robots.drive_log import DriveLog
from geoimp_drake.robots.robot_arm import RobotError
from geoimp_drake.systems.sources.desired_motion import MotionSegment
from geoimp_drake.systems.sources.external_wrench import WrenchRamp

MOVE = MotionSegment(1.0, [0.05, 0.0, -0.05], [0.0, 0.0, 0.2])
NOT_FELT = DriveConfig(wrench="none")


def modes(log: DriveLog) -> list[Mode]:
    """Returns the modes in the order in which they came."""
    each = log.values["mode"][:, 0]
    return [Mode(int(mode)) for mode in each[np.flatnonzero(np.diff(each, prepend=-1.0))]]


def distance(log: DriveLog, A: str, B: str) -> np.ndarray:
    """Returns the distance of two frames' origins over time [m]."""
    return np.linalg.norm(log.values[A][:, POSITION] - log.values[B][:, POSITION], axis=1)


@pytest.mark.parametrize("gravity", ["robot", "controller"])
@pytest.mark.parametrize("model", ["six_joint_arm", "seven_joint_arm"])
def test_an_arm_starts_follows_and_stops(model, gravity):
    log = DrivenArm(model, gravity).drive(1.2, MOVE)
    assert modes(log) == [Mode.SOFT_START, Mode.RUN, Mode.BRAKE, Mode.STOPPED]
    assert distance(log, "motion_E", "motion_D").max() < 2e-4
    moved = log.values["motion_E"][-1, POSITION] - log.values["motion_E"][0, POSITION]
    np.testing.assert_allclose(moved, MOVE.displacement, rtol=0, atol=1e-4)


def test_a_push_is_observed_and_yielded_to():
    push = WrenchRamp(force=np.array([0.0, 0.0, 15.0]), start=0.8, duration=0.2, blend=0.05)
    log = DrivenArm(push=push).drive(6.0)
    way = log.values["motion_E"][-1, POSITION] - log.values["motion_D"][-1, POSITION]
    np.testing.assert_allclose(way, [0.0, 0.0, 15.0 / STIFFNESS], rtol=0, atol=5e-3 * 0.03)


def told(caplog: pytest.LogCaptureFixture) -> list[tuple[str, str]]:
    """Returns level and words of each change of mode, in their order."""
    records = [(record.levelname, record.getMessage()) for record in caplog.records]
    return [(level, words) for level, words in records if " to " in words and "t = " in words]


def test_every_change_of_mode_is_told_once_with_its_reason(caplog):
    """Fifteen ticks without a status are one change; a motion that ends by itself is no warning."""
    caplog.set_level("INFO", "drake")

    def disturb(count, status):
        return None if 600 <= count < 615 else status

    log = DrivenArm().drive(0.3, config=NOT_FELT, through=lambda robot: Between(robot, disturb))
    expected = [
        "INIT to SOFT_START, the first valid reading.",
        "SOFT_START to RUN, what is sent has faded in.",
        "RUN to HOLD, no valid reading.",
        "HOLD to RUN, valid readings again.",
        "RUN to BRAKE, the motion has ended.",
        "BRAKE to STOPPED, D rests.",
    ]
    assert [words.split(": ")[-1] for _, words in told(caplog)] == expected
    assert {level for level, _ in told(caplog)} == {"INFO"}
    assert len(modes(log)) == len(expected)


def test_a_status_lost_in_the_soft_start_does_not_end_it():
    """The robot's own torques are 0.5 Nm away from the controller's: these fade in all the same."""

    def disturb(count, status):
        return None if 200 <= count < 210 else replace(status, torque=status.torque + 0.5)

    arm = DrivenArm()
    log = arm.drive(0.5, MOVE, config=NOT_FELT, through=lambda robot: Between(robot, disturb))
    begun = [Mode.SOFT_START, Mode.HOLD, Mode.SOFT_START, Mode.RUN]
    assert modes(log)[: len(begun)] == begun
    fading = np.flatnonzero(log.values["mode"][:, 0] == Mode.SOFT_START)
    torque = log.values["torque"][: fading[-1] + 1]
    assert np.abs(np.diff(torque, axis=0)).max() < 0.1
    assert np.abs(torque[0]).max() > 0.4
    D = log.values["motion_D"]
    np.testing.assert_array_equal(D[fading[-1], POSITION], D[0, POSITION])


def test_a_soft_start_takes_no_longer_where_many_statuses_are_lost():
    """Each gap once began it anew, and no drive behind a bad connection ever began to move."""

    def disturb(count, status):
        return status if count % 3 else None

    log = DrivenArm().drive(0.3, config=NOT_FELT, through=lambda robot: Between(robot, disturb))
    begun = np.flatnonzero(log.values["mode"][:, 0] == Mode.RUN)[0]
    gaps = SupervisorConfig().soft_start / 1e-3 / 2.0  # one in three ticks
    assert begun <= SupervisorConfig().soft_start / 1e-3 + gaps + 5
    assert modes(log)[-1] is Mode.STOPPED


class Counting(Between):
    """Counts the laws that are compiled when the torques are taken over, and when given back."""

    counts: list[int]
    made: list[Any]

    def count(self) -> None:
        self.counts.append(sum(len(law.overloads) for law in self.made))

    def start(self) -> None:
        self.count()

    def stop(self) -> None:
        self.count()


@pytest.mark.skipif(not compiled.is_available(), reason="numba is not there")
@pytest.mark.parametrize("wrench", ["observer", "robot"])
def test_nothing_is_compiled_once_the_torques_are_taken_over(wrench, monkeypatch):
    """Through a rest, a gap, a motion and a stop, by laws that were compiled nowhere before."""
    made = []

    @cache
    def anew(law):
        made.append(original(law))
        return made[-1]

    @cache
    def bound_anew(law, kinds):
        made.append(original_bound(law, kinds))
        return made[-1]

    original, original_bound = compiled._compiled.__wrapped__, compiled._bound.__wrapped__
    monkeypatch.setattr(compiled, "_compiled", anew)
    monkeypatch.setattr(compiled, "_bound", bound_anew)

    def through(robot):
        driver = Counting(robot, lambda count, status: None if 600 <= count < 603 else status)
        driver.made, driver.counts = made, counts
        return driver

    counts: list[int] = []
    rest, config = MotionSegment(0.2), DriveConfig(wrench=wrench)
    log = DrivenArm().drive(0.5, rest, MOVE, config=config, through=through)
    assert len(modes(log)) == 6
    assert counts[0] == counts[1] > 3


@pytest.mark.parametrize("lost", [1, 15])
def test_lost_statuses_are_bridged(lost):
    def disturb(count, status):
        return None if 1000 <= count < 1000 + lost else status

    arm = DrivenArm()
    log = arm.drive(1.2, MOVE, config=NOT_FELT, through=lambda robot: Between(robot, disturb))
    assert modes(log)[1:5] == [Mode.RUN, Mode.HOLD, Mode.RUN, Mode.BRAKE]
    assert np.nanmax(distance(log, "motion_E", "motion_C")) < 1e-3


def test_a_gap_of_20_ms_is_not_seen_on_the_arm():
    """The torques of the gap's beginning are kept; C catches up in small steps."""

    def disturb(count, status):
        return None if 1000 <= count < 1019 else status

    limits = SupervisorLimits(torque_rate=1000.0)
    config = DriveConfig(wrench="none", supervisor=SupervisorConfig(limits=limits))
    arm = DrivenArm("light7")
    log = arm.drive(1.2, MOVE, config=config, through=lambda robot: Between(robot, disturb))
    assert modes(log)[1:4] == [Mode.RUN, Mode.HOLD, Mode.RUN]
    gap = np.flatnonzero(log.values["mode"][:, 0] == Mode.HOLD)
    after = np.arange(gap[-1] + 1, gap[-1] + 400)
    assert np.linalg.norm(log.values["motion_D"][gap[0], LINEAR_VELOCITY]) > 0.05
    assert distance(log, "motion_E", "motion_C")[after].max() <= 5e-5
    assert np.abs(np.diff(log.values["torque"][gap[0] : after[-1]], axis=0)).max() <= 1.0 + 1e-9


def test_too_many_lost_statuses_end_in_a_stop():
    arm, drivers = DrivenArm(), []

    def through(robot):
        def disturb(count, status):
            return status if count < 1000 or count > 1050 else None

        drivers.append(Between(robot, disturb))
        return drivers[0]

    log = arm.drive(1.2, MOVE, config=NOT_FELT, through=through)
    assert modes(log)[1:] == [Mode.RUN, Mode.HOLD, Mode.BRAKE, Mode.STOPPED]
    assert log.ticks < 1300
    assert drivers[0].stopped == 1


def test_a_robot_that_was_silent_is_braked_even_if_its_own_clock_stood_still(caplog):
    def through(robot):
        def disturb(count, status):
            if count == 1000:
                time.sleep(0.5)
            return status

        driver = Between(robot, disturb)
        driver.real_time = True
        return driver

    patient = DriveConfig(wrench="none", supervisor=SupervisorConfig(hold=0.3))
    log = DrivenArm().drive(3.0, MOVE, config=patient, through=through)
    assert modes(log)[-2:] == [Mode.BRAKE, Mode.STOPPED]
    assert log.ticks < 1200
    assert "no valid reading for 5" in caplog.text


@pytest.mark.parametrize(
    "broken",
    [
        lambda status: replace(status, q=status.q * np.nan),
        lambda status: replace(status, v=status.v + np.inf),
        lambda status: replace(status, time=status.time - 0.5),
    ],
    ids=["NaN", "infinity", "time going back"],
)
def test_a_status_that_cannot_be_counts_as_none(broken):
    def disturb(count, status):
        return broken(status) if count == 700 else status

    arm = DrivenArm()
    log = arm.drive(0.4, config=NOT_FELT, through=lambda robot: Between(robot, disturb))
    assert modes(log)[1:4] == [Mode.RUN, Mode.HOLD, Mode.RUN]
    assert np.isfinite(log.values["torque"]).all()


@pytest.mark.parametrize("wrench", ["none", "robot", "observer"])
@pytest.mark.parametrize(
    "broken",
    [
        lambda status: replace(status, q=status.q * np.nan),
        lambda status: replace(status, time=np.nan),
        lambda status: None,
    ],
    ids=["NaN", "no time", "silence"],
)
def test_statuses_that_are_none_for_good_end_the_drive(broken, wrench):
    def disturb(count, status):
        assert count < 2000, "the drive does not stop"
        return broken(status) if count >= 700 else status

    log = DrivenArm().drive(
        5.0, MOVE, config=DriveConfig(wrench), through=lambda robot: Between(robot, disturb)
    )
    assert modes(log)[-1] is Mode.STOPPED
    assert modes(log).count(Mode.BRAKE) <= 2
    assert log.ticks < 700 + 20 + 2 * 151 + 25


def test_a_stop_from_speed_takes_little_way_and_no_jump():
    # The largest speed of such a motion is 1.875 Δ/T, after half the time.
    fast = MotionSegment(1.0, [0.0, 0.0, -0.16])
    log = DrivenArm("light7").drive(0.5, fast, config=NOT_FELT)
    braking = log.values["mode"][:, 0] == Mode.BRAKE
    speed = np.linalg.norm(log.values["motion_D"][:, LINEAR_VELOCITY], axis=1)
    D = log.values["motion_E"][:, POSITION]
    begun = np.flatnonzero(braking)[0]
    assert speed[begun] == pytest.approx(0.3, rel=0.01)
    assert np.linalg.norm(D[-1] - D[begun]) < 0.025
    rates = np.abs(np.diff(log.values["torque"], axis=0)) / 1e-3
    assert rates.max() <= 1000.0 + 1e-6


def limited(**limits: float) -> DriveConfig:
    return DriveConfig(
        wrench="none", supervisor=SupervisorConfig(limits=SupervisorLimits(**limits))
    )


@pytest.mark.parametrize(
    ("limits", "reason"),
    [
        ({"speed": 0.05}, "speed 0.05"),
        ({"turning_speed": 0.2}, "turning speed 0.2"),
        ({"torque": 0.0005}, "torque 0.0005"),
        ({"desired_speed_step": 1e-6}, "desired speed step"),
        ({"desired_step": 1e-6}, "desired step"),
        ({"tracking": 1e-9}, "tracking"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_an_excess_brakes_and_names_what_and_how_much(limits, reason, caplog):
    log = DrivenArm().drive(1.2, MOVE, config=limited(**limits))
    assert modes(log)[-2:] == [Mode.BRAKE, Mode.STOPPED]
    assert log.ticks < 1700
    (limit,) = limits.values()
    told = [record.getMessage() for record in caplog.records if "to BRAKE" in record.getMessage()]
    assert len(told) == 1
    assert reason.split()[0] in told[0]
    assert f"exceeds {limit:g}" in told[0]


def test_an_interrupt_brakes_and_then_stops(caplog):
    def disturb(count, status):
        if count == 900:
            os.kill(os.getpid(), signal.SIGINT)
        return status

    before = signal.getsignal(signal.SIGINT)  # ignored where the tests are a shell's background job
    arm = DrivenArm()
    log = arm.drive(5.0, MOVE, config=NOT_FELT, through=lambda robot: Between(robot, disturb))
    assert modes(log)[1:] == [Mode.RUN, Mode.BRAKE, Mode.STOPPED]
    assert log.ticks == pytest.approx(900 + 151, abs=3)
    assert [words.split(": ")[-1] for level, words in told(caplog) if level == "WARNING"] == [
        "RUN to BRAKE, asked to stop."
    ]
    assert signal.getsignal(signal.SIGINT) is before


def test_an_error_leaves_the_arm_with_its_own_controller():
    drivers = []

    def through(robot):
        def disturb(count, status):
            if count == 600:
                raise RobotError("the robot has gone")
            return status

        drivers.append(Between(robot, disturb))
        return drivers[0]

    log = DrivenArm().drive(1.0, config=NOT_FELT, through=through)
    assert str(log.failure) == "the robot has gone"
    assert drivers[0].stopped == 1
    assert len(log.values["t"]) == log.ticks == 598


def test_robot_and_controller_must_fit():
    arm = DrivenArm()
    others = {
        "gravity='robot'": {"gravity": "controller", "joints": arm.robot.joints},
        "joints=robot.joints": {"gravity": "robot", "joints": arm.robot.joints[::-1]},
    }
    E = arm.plant.GetFrameByName("flange")
    instance = arm.plant.GetModelInstanceByName("robot")
    for words, options in others.items():
        loop = ControlLoop(arm.plant, instance, E, **options)
        with pytest.raises(ConfigurationError, match=words):
            Drive(arm.robot, loop)
    slow = ControlLoop(arm.plant, instance, E, gravity="robot", joints=arm.robot.joints)
    slow.period = 2e-3
    with pytest.raises(ConfigurationError, match=r"0.001 s.*0.002 s"):
        Drive(arm.robot, slow)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda _: None, "does not answer"),
        (lambda status: replace(status, q=status.q * np.nan), "these are not finite numbers"),
        (lambda status: replace(status, v=status.v[:5]), "reports 5 or 6 joints"),
    ],
    ids=["no answer", "NaN", "one velocity less"],
)
def test_a_first_status_that_cannot_be_is_refused_before_anything_is_commanded(change, words):
    arm, commands = DrivenArm(), []

    class Strange(Between):
        def connect(self):
            return change(self._robot.connect())

        def start(self) -> None:
            commands.append("start")

    with pytest.raises(RobotError, match=words):
        arm.drive(0.1, config=NOT_FELT, through=lambda robot: Strange(robot, lambda _, s: s))
    assert commands == []
