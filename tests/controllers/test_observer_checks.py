"""An impedance on a momentum observer, torques a tick late: the linear model says where it ends."""

import importlib.util
import logging
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from driven_arm import LIGHT, DrivenArm, gains

from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.observer_checks import observed_loop, warn_of_late_torque
from geoimp_drake.models import model_path
from geoimp_drake.parts.momentum_observer import MomentumObserverConfig
from geoimp_drake.parts.supervisor import Mode, SupervisorConfig
from geoimp_drake.robots.drive import Drive, DriveConfig

ROBOTS = {
    "six_joint_arm": (model_path("six_joint_arm"), "flange"),
    "seven_joint_arm": (model_path("seven_joint_arm"), "flange"),
    "light7": (LIGHT, "l7"),
}
ROBOT_LATE = {"acts_late": True, "believed_late": False}
OBSERVER_LATE = {"acts_late": False, "believed_late": True}


@cache
def study() -> ModuleType:
    """The script that draws the page's figure."""
    path = Path(__file__).parents[2] / "docs" / "validation" / "studies" / "late_torque.py"
    spec = importlib.util.spec_from_file_location("late_torque", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@cache
def trial(robot: str):
    return study().Trial(*ROBOTS[robot])


@pytest.mark.parametrize("late", [ROBOT_LATE, OBSERVER_LATE], ids=["robot", "observer"])
@pytest.mark.parametrize(
    ("robot", "scale"), [("six_joint_arm", 1.0), ("seven_joint_arm", 1.0), ("light7", 0.02)]
)
def test_the_model_says_what_a_simulation_does(robot, scale, late):
    """Masses of 1 to 100 kg with a fiftieth of that in kg m²; of a light arm a fiftieth."""
    seen = []
    for gain in np.geomspace(25.0, 800.0, 4):
        for mass in scale * np.geomspace(1.0, 100.0, 6):
            point = study().Impedance(mass, mass / 50.0), gain
            seen.append(
                [f(*point, **late) for f in (trial(robot).predicted, trial(robot).simulated)]
            )
    predicted, simulated = np.array(seen).T
    unstable = predicted > 1.0
    assert 4 <= unstable.sum() <= len(unstable) - 4
    assert ((simulated > 1.0) == unstable).mean() >= 0.95


@pytest.mark.parametrize("varied", ["mass", "inertia"])
@pytest.mark.parametrize("robot", ["six_joint_arm", "seven_joint_arm"])
def test_the_border_is_found_within_two_percent(robot, varied):
    others, scale = study().Impedance(100.0, 4.0), {"mass": 1.0, "inertia": 0.01}[varied]
    for gain in (50.0, 200.0):
        predicted, simulated = (
            study().border(
                lambda m, f=f, g=gain: f(replace(others, **{varied: m}), g), scale, 100.0 * scale
            )
            for f in (trial(robot).predicted, trial(robot).simulated)
        )
        assert predicted == pytest.approx(simulated, rel=0.02)


def test_nothing_grows_if_the_observer_believes_what_acts():
    for late in (False, True):
        both = {"acts_late": late, "believed_late": late}
        point = study().Impedance(0.5, 0.02), 800.0
        assert trial("six_joint_arm").predicted(*point, **both) < 1.0
        assert trial("six_joint_arm").simulated(*point, **both) < 1.0


def warning(caplog, config: ImpedanceControllerConfig, gain: float) -> str:
    arm = trial("six_joint_arm")
    caplog.clear()
    with caplog.at_level(logging.WARNING, logger="drake"):
        warn_of_late_torque(arm.model, arm.q, config, MomentumObserverConfig(gain=gain))
    return caplog.text


def test_what_the_warning_advises_is_stable_and_no_more_than_is_needed(caplog):
    config = ImpedanceControllerConfig()  # 9 kg, 0.4 kg m²
    text = warning(caplog, config, 200.0)
    found = re.search(r"grow ([\d.]+)-fold.*gain by ([\d.]+), or multiply .* by ([\d.]+)\.", text)
    growth, slower, heavier = map(float, found.groups())
    assert growth == pytest.approx(2.39, abs=0.05)
    for share, is_said in ((1.0, False), (0.9, True)):
        assert bool(warning(caplog, config, 200.0 / (share * slower))) == is_said
        heavy = ImpedanceControllerConfig()
        for part in (heavy.impedance.translation, heavy.impedance.rotation):
            part.mass = part.mass * share * heavier
        assert bool(warning(caplog, heavy, 200.0)) == is_said


def test_a_direct_impedance_has_another_border():
    arm = trial("six_joint_arm")
    light, observer = study().Impedance(4.0, 4.0).config(), MomentumObserverConfig(gain=50.0)
    light.scheme = "direct"
    assert observed_loop(arm.model, arm.q, light, observer).growth() > 1.0
    heavy = study().Impedance(20.0, 4.0).config()
    heavy.scheme = "direct"
    assert observed_loop(arm.model, arm.q, heavy, observer).growth() < 1.0


def test_natural_inertia_takes_no_wrench_and_is_not_asked(caplog):
    config = ImpedanceControllerConfig(scheme="direct")
    assert "unstable" in warning(caplog, config, 200.0)
    config.inertia = "natural"
    assert not warning(caplog, config, 200.0)


def test_a_singular_posture_is_no_error(caplog):
    arm = trial("six_joint_arm")
    loop = observed_loop(arm.model, 0.0 * arm.q, gains(), MomentumObserverConfig())
    assert np.isfinite(loop.growth())


class Late:
    """A driver whose robot has a clock of its own, and exerts torques a tick late."""

    real_time = True

    def __init__(self, robot):
        self._robot, self._torque = robot, None

    def __getattr__(self, name):
        return getattr(self._robot, name)

    def write(self, torque):
        self._robot.write(torque if self._torque is None else self._torque)
        self._torque = torque.copy()


PATIENT = SupervisorConfig(hold=60.0)  # however slow the machine is


@pytest.mark.parametrize(("gain", "is_stable"), [(100.0, True), (800.0, False)])
def test_a_drive_warns_before_the_robot_is_taken_over(caplog, gain, is_stable):
    arm, began = DrivenArm(), []
    robot = Late(arm.robot)
    robot.start = lambda: began.append(caplog.text)
    config = DriveConfig("observer", MomentumObserverConfig(gain=gain), PATIENT)
    drive = Drive(robot, arm.loop, config)
    drive.look()  # as whoever makes a motion from where the hand is
    log = drive.run(arm.motion(), 0.3)
    (said,) = began
    assert said.count("act a tick of 1 ms late") == (not is_stable)
    modes = log.values["mode"][:, 0]
    assert (Mode.RUN in modes) == is_stable  # it swings as the torques fade in
    assert (np.abs(log.values["wrench"]).max() < 1.0) == is_stable


@pytest.mark.parametrize("wrench", ["observer", "none"])
def test_a_robot_that_waits_and_one_without_observer_are_not_warned_of(caplog, wrench):
    arm = DrivenArm()
    arm.robot.real_time = wrench == "none"
    observer = MomentumObserverConfig(gain=800.0)
    Drive(arm.robot, arm.loop, DriveConfig(wrench, observer)).look()
    assert "late" not in caplog.text
