"""A load and biases are found by driving the arm to postures, and from the log of that motion."""

import re

import numpy as np
import pytest
import yaml
from driven_arm import LIGHT

from geoimp_drake.cli import main
from geoimp_drake.diagrams.setups import driven_arm
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.robot_files.config import RobotConfig
from geoimp_drake.robots import tare_drive
from geoimp_drake.robots.driver_config import DriverConfig

BIAS = [0.1, -0.2, 0.05, 2.0, -1.5, 0.7]  # of the sensor, in S
TEXT = f"""
experiment: custom
arm: mine
robot: {{file: {LIGHT}, end_effector: l7, geometry: leave-out,
  payload: {{mass: 0.5, centre_of_mass: [0.01, -0.02, 0.06]}},
  driver: {{supervisor: {{limits: {{speed: .inf, turning_speed: .inf}}}}}}}}
duration: 1.0
sensor: {{bias: {BIAS}, force_noise: 0.03, moment_noise: 2.5e-3}}
start: {{posture: [0.1, 0.6, 0.0, -1.2, 0.2, 0.8, 0.0]}}
"""
POSTURES = """
- [0.1, 0.6, 0.0, -1.2, 0.2, 0.8, 0.0]
- [0.3, 0.4, 0.5, -1.4, 1.0, 0.3, 0.8]
- [0.0, 0.8, -0.5, -0.8, -2.55, 1.4, -0.6]
- [0.2, 0.3, 0.2, -1.6, 0.9, 1.6, 0.2]
- [-0.3, 0.7, 0.4, -0.5, -0.8, -0.4, 0.9]
- [0.1, 1.0, -0.2, -1.2, 0.3, 0.2, 2.55]
"""


def numbers(text: str, key: str) -> np.ndarray:
    """Returns the numbers of a printed YAML list."""
    return np.array(yaml.safe_load(re.search(rf"{key}: (\[.*?\])", text)[1]))


def check_load(printed: str, mass: float, moment: float) -> None:
    """Checks what is left over of a load, as force and moment [N, Nm]."""
    found = float(re.search(r"payload: { mass: ([\d.]+)", printed)[1])
    centre = numbers(printed, "centre_of_mass")
    assert abs(found - 0.5) * 9.81 <= mass
    assert np.linalg.norm(found * centre - 0.5 * np.array([0.01, -0.02, 0.06])) * 9.81 <= moment


def check_rests(log) -> None:
    """Checks that the arm has rested in every posture, near the ends of its joints' ranges too."""
    whole = log.whole
    resting = (np.abs(whole["v"]) < 0.01).all(axis=1)
    for posture in yaml.safe_load(POSTURES):
        near = np.abs(whole["q"] - posture).max(axis=1) < 2e-3
        assert np.count_nonzero(near & resting) > 10


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").write_text(TEXT, "utf-8")
    (tmp_path / "postures.yaml").write_text(POSTURES, "utf-8")
    return tmp_path


def test_an_arm_is_driven_to_postures_and_what_is_found_serves_its_scenario(
    folder, capsys, monkeypatch
):
    monkeypatch.setattr(tare_drive, "_SPEED", 1.5)
    monkeypatch.setattr(tare_drive, "_DWELL", 0.4)
    drives = []
    tour = driven_arm.ScenarioDrive.tour

    def kept(self, *args):
        drives.append((self, tour(self, *args)))
        return drives[-1][1]

    monkeypatch.setattr(driven_arm.ScenarioDrive, "tour", kept)
    assert main(["tare", "mine.yaml", "--drive", "postures.yaml", "--wrist"]) == 0
    printed = capsys.readouterr().out
    check_load(printed, 0.05, 5e-3)
    bias = numbers(printed, "wrench_bias")
    assert np.linalg.norm(bias[3:]) == pytest.approx(np.linalg.norm(BIAS[3:]), abs=0.02)

    # The lines that were printed are a scenario's.
    pasted = yaml.safe_load(printed.split("for the scenario:\n")[1])
    assert set(pasted["robot"]) == {"payload", "driver"}

    # The same from the log of the motion, at the wrist and at the joints.
    ((drive, log),) = drives
    check_rests(log)
    rows = drive.log(log) | {"mine/wrench": log.whole["reported_wrench"]}
    np.savez(folder / "log.npz", **rows)
    for options in (["--wrist"], []):
        assert main(["tare", "mine.yaml", "--log", "log.npz", *options]) == 0
        check_load(printed := capsys.readouterr().out, 0.05, 5e-3)
        if options:
            np.testing.assert_allclose(numbers(printed, "wrench_bias"), bias, atol=0.02)

    # The bias is E's: subtracted in another posture nothing is left but noise.
    driver = DriverConfig(wrench="robot", wrench_bias=bias)
    robot = RobotConfig(str(LIGHT), "l7", geometry="leave-out", driver=driver)
    own = SingleArmScenario(arm="mine", robot=robot, duration=0.1)
    own.start.posture = [0.5, 0.2, 0.9, -1.0, 1.3, 0.4, -1.0]
    own.sensor.bias = np.array(BIAS)
    wrench = driven_arm.ScenarioDrive(own).run().values["wrench"]
    np.testing.assert_allclose(wrench.mean(axis=0), 0.0, rtol=0, atol=0.02)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--drive", "nowhere.yaml"], "nowhere.yaml"),
        (["--drive", "mine.yaml"], "is not a list of postures"),
        (["--drive", "short.yaml"], "2×7 finite numbers"),
        (["--drive", "ragged.yaml"], "ragged.yaml"),
        (["--drive", "far.yaml"], "Posture 2 has j2 at 9; its limits are"),
        (["--drive", "postures.yaml", "--log", "log.npz"], "not allowed with"),
        (["--log", "nowhere.npz"], "nowhere.npz"),
        (["--log", "other.npz"], "The log has no mine/q"),
        (["--log", "few.npz"], "has 3 rows without gaps"),
        (["--set", "robot.driver.wrench_bias=[0,0,0,0,0,1]"], "wrench_bias is of the wrench that"),
    ],
)
def test_bad_input_is_one_line(arguments, words, folder, capsys):
    (folder / "short.yaml").write_text("- [0.1, 0.2]\n- [0.1, 0.3]\n", "utf-8")
    (folder / "ragged.yaml").write_text("- [0.1, 0.2]\n- [0.1]\n", "utf-8")
    (folder / "far.yaml").write_text(f"- {[0.0] * 7}\n- {[0.0, 9.0] + [0.0] * 5}\n", "utf-8")
    np.savez(folder / "other.npz", t=np.arange(3.0))
    rows = {"q": 7, "v": 7, "u": 7, "wrench": 6}
    zeros = {f"mine/{name}": np.zeros((3, size)) for name, size in rows.items()}
    np.savez(folder / "few.npz", t=np.arange(3.0), **zeros)
    try:
        status = main(["tare", "mine.yaml", *arguments])
    except SystemExit as stop:
        status = stop.code
    assert status == 2
    (error,) = [
        line for line in capsys.readouterr().err.splitlines() if not line.startswith("Robot 'mine'")
    ]
    assert error.startswith("geoimp: ")
    assert words in error
