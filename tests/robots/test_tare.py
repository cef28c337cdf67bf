"""What hangs on an arm is found from what its joints feel at rest."""

import re
from dataclasses import replace

import numpy as np
import pytest
from driven_arm import LIGHT, Between

from geoimp_drake.cli import main
from geoimp_drake.diagrams.setups import driven_arm
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.diagrams.setups.tared_arm import payload_of
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.robot_files.config import PayloadConfig, RobotConfig
from geoimp_drake.robots.robot_arm import RobotError

MASS, CENTRE = 0.5, np.array([0.01, -0.02, 0.06])


def scenario(payload: bool = True) -> SingleArmScenario:
    carried = PayloadConfig(MASS, CENTRE) if payload else None
    robot = RobotConfig(str(LIGHT), "l7", geometry="leave-out", payload=carried)
    return SingleArmScenario(arm="mine", robot=robot, duration=1.0)


def test_a_payload_is_found_and_nothing_where_there_is_none():
    found, joints = payload_of(scenario(), 6, lambda _: None)
    assert found.mass == pytest.approx(MASS, rel=1e-6)
    np.testing.assert_allclose(found.centre_of_mass, CENTRE, rtol=0, atol=1e-6)
    np.testing.assert_allclose(found.bias, 0.0, rtol=0, atol=1e-6)
    assert joints == tuple(f"j{k}" for k in range(1, 8))
    assert abs(payload_of(scenario(payload=False), 6, lambda _: None)[0].mass) < 1e-6


def test_noise_and_biases_of_the_joints_leave_little(monkeypatch):
    """Noise of 0.05 Nm, and biases as large as the load: what is left over is felt at the hand."""
    random, bias = np.random.default_rng(3), np.array([0.4, -0.6, 0.2, 0.5, -0.1, 0.2, 0.1])
    true = driven_arm.simulated_robot

    def noisy(own, **options):
        def disturb(_, status):
            return replace(status, torque=status.torque - bias + 0.05 * random.normal(size=7))

        return Between(true(own, **options), disturb)

    monkeypatch.setattr(driven_arm, "simulated_robot", noisy)
    found, _ = payload_of(scenario(), 10, lambda _: None)
    assert abs(found.mass - MASS) * 9.81 <= 0.05
    moment = found.mass * found.centre_of_mass - MASS * CENTRE
    assert np.linalg.norm(moment) * 9.81 <= 5e-3
    np.testing.assert_allclose(found.bias, bias, rtol=0, atol=0.02)
    assert found.condition < 6.0


@pytest.mark.parametrize("payload", [True, False])
def test_a_wrist_sensor_finds_the_payload_and_its_own_bias(payload):
    """With the noise of a sensor."""
    own, b = scenario(payload), np.array([0.1, -0.2, 0.05, 2.0, -1.5, 0.7])
    own.sensor.bias = b
    own.sensor.force_noise, own.sensor.moment_noise = 0.03, 2.5e-3
    found, _ = payload_of(own, 8, lambda _: None, at_wrist=True)
    mass = MASS if payload else 0.0
    assert abs(found.mass - mass) * 9.81 <= 0.05
    assert np.linalg.norm(found.mass * found.centre_of_mass - mass * CENTRE) * 9.81 <= 5e-3
    assert np.linalg.norm(found.bias[3:] - b[3:]) <= 0.05
    assert np.linalg.norm(found.bias[:3]) > 0.1


@pytest.fixture
def file(tmp_path):
    text = f"""
experiment: custom
arm: mine
robot: {{file: {LIGHT}, end_effector: l7, geometry: leave-out,
  payload: {{mass: 0.5, centre_of_mass: [0.01, -0.02, 0.06]}}}}
duration: 1.0
"""
    path = tmp_path / "mine.yaml"
    path.write_text(text, "utf-8")
    return path


@pytest.mark.parametrize("options", [[], ["--wrist"]])
def test_the_command_prints_lines_for_the_scenario(options, file, capsys):
    assert main(["tare", str(file), *options]) == 0
    printed = capsys.readouterr().out
    assert ("bias of the wrench in E" in printed) == bool(options)
    assert "payload: { mass: 0.5000, centre_of_mass: [0.01000, -0.02000, 0.06000] }" in printed
    assert re.search(r"condition \d", printed)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--postures", "1"], "--postures"),
        (["--set", "robot.payload.mass=-1"], "robot.payload.mass"),
        (["--set", "robot.driver.kind=lcm"], "in a terminal"),
    ],
)
def test_bad_input_is_one_line(arguments, words, file, capsys, monkeypatch):
    def end(_):
        raise EOFError

    monkeypatch.setattr("builtins.input", end)
    assert main(["tare", str(file), *arguments]) == 2
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert words in error


def test_postures_that_are_too_alike_are_refused(monkeypatch):
    monkeypatch.setattr("geoimp_drake.robots.tare._SPREAD", 0.02)
    with pytest.raises(ConfigurationError, match=r"condition number is .*above 20"):
        payload_of(scenario(), 6, lambda _: None)


def test_a_robot_that_moves_or_feels_nothing_is_refused(monkeypatch):
    true = driven_arm.simulated_robot
    moving = lambda own, **_: Between(true(own), lambda _, s: replace(s, v=s.v + 0.1))  # noqa: E731
    monkeypatch.setattr(driven_arm, "simulated_robot", moving)
    with pytest.raises(RobotError, match=r"moves at 0.1"):
        payload_of(scenario(), 6, lambda _: None)
    numb = lambda own, **_: Between(  # noqa: E731
        true(own, gravity="robot"), lambda _, s: replace(s, external_torque=None)
    )
    monkeypatch.setattr(driven_arm, "simulated_robot", numb)
    with pytest.raises(RobotError, match="no external torques"):
        payload_of(scenario(), 6, lambda _: None)
