"""A robot of one's own without Python: in a scenario's YAML."""

from pathlib import Path

import numpy as np
from published_arms import RosArm

from geoimp_drake.cli import main
from geoimp_drake.systems.frame_motion import POSITION

CASES = Path(__file__).parent / "cases"

PRESSED = """
experiment: custom
arm: mine
robot: {{ file: {file}, end_effector: tool0, offset_position: [0.1, 0, 0] }}
start: {{ position: null }}
duration: 1.5
impedance:
  translation: {{ mass: 4.0, damping: 180.0, stiffness: 700.0 }}
  rotation: {{ mass: 0.1, damping: 3.0, stiffness: 10.0 }}
sensor: {{ inertial_load: reference }}
external: {{ force: [0, 9, 12], duration: 0.2, blend: 0.1 }} # on the hand, in W
"""


def test_a_robot_of_ones_own_in_the_file(tmp_path, capsys):
    """Its path is found beside the file; the start posture is looked for; the spring is there."""
    description = RosArm(gripper=True).write(tmp_path)
    file = tmp_path / "mine.yaml"
    file.write_text(PRESSED.format(file=description.relative_to(tmp_path)))
    out = tmp_path / "out"
    assert main(["run", "--scenario", str(file), "--out", str(out), "--no-figures"]) == 0
    log = np.load(out / "log.npz")
    wrench = log["mine/wrench_true"][-1]
    displacement = (log["mine/motion_D"] - log["mine/motion_C"])[-1, POSITION]
    np.testing.assert_allclose(wrench[3:], [0.0, -9.0, -12.0], atol=0.3)
    np.testing.assert_allclose(700.0 * displacement, wrench[3:], atol=0.1)
    moved = np.diff(log["mine/motion_E"][[0, -1], POSITION], axis=0)[0]
    np.testing.assert_allclose(700.0 * moved, [0.0, 9.0, 12.0], atol=0.5)
    again = tmp_path / "again"
    saved = out / "scenario.yaml"
    assert main(["run", "--scenario", str(saved), "--out", str(again), "--no-figures"]) == 0
    repeated = np.load(again / "log.npz")
    for key in log:
        np.testing.assert_array_equal(log[key], repeated[key])


def test_a_robot_with_collision_stands_beside_a_surface(tmp_path):
    """Spheres have no hydroelastic contact; near the hand's disk they touch as points."""
    file = tmp_path / "mine.yaml"
    text = PRESSED.format(file=CASES / "spheres.urdf").replace("[0.1, 0, 0]", "[0, 0, 0.1]")
    text = text.replace("tool0,", "l6, geometry: convert,").replace("1.5", "0.02")
    file.write_text(text + "surface: { point: [0.6, 0, 0.1] }\n")
    arguments = ["--out", str(tmp_path / "out"), "--no-figures"]
    assert main(["run", "--scenario", str(file), *arguments]) == 0
    np.testing.assert_allclose(np.load(tmp_path / "out" / "log.npz")["t"][-1], 0.02)


def test_a_robot_file_that_is_not_there_is_named(tmp_path, capsys):
    file = tmp_path / "mine.yaml"
    file.write_text(PRESSED.format(file="nowhere.urdf"))
    assert main(["run", "--scenario", str(file), "--out", str(tmp_path / "out")]) == 2
    assert "nowhere.urdf" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
