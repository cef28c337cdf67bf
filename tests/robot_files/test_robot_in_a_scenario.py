"""A robot of one's own without Python: in a scenario's YAML."""

from pathlib import Path

import numpy as np
from browser import visit
from published_arms import RosArm, painted_dae

from geoimp_drake.cli import main
from geoimp_drake.systems.frame_motion import POSITION

CASES = Path(__file__).parent / "cases"

PRESSED = """
experiment: custom
arm: mine
robot: {{ file: {file}, end_effector: tool0, offset_position: [0.1, 0, 0] }}
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
    """Spheres have no hydroelastic contact: the third link touches the surface as a point."""
    file = tmp_path / "mine.yaml"
    text = PRESSED.format(file=CASES / "spheres.urdf").replace("[0.1, 0, 0]", "[0, 0, 0.1]")
    text = text.replace("tool0,", "l6, geometry: convert,").replace("1.5", "0.02")
    file.write_text(text + "surface: { point: [0, -0.08, 0.89], normal: [0, -1, 0] }\n")
    arguments = ["--out", str(tmp_path / "out"), "--no-figures"]
    assert main(["run", "--scenario", str(file), *arguments]) == 0
    np.testing.assert_allclose(np.load(tmp_path / "out" / "log.npz")["t"][-1], 0.02)


# Whether a mesh of a robot has a colour, written as RRGGBB.
HAS_COLOUR = """([name, colour]) => {
    let found = false;
    viewer.scene_tree.children.drake.children.visualizer.children[name].object.traverse(o => {
        for (const m of o.isMesh ? [o.material].flat() : [])
            found ||= m.color.getHexString() === colour;
    });
    return found;
}"""


def test_the_replay_shows_a_robot_in_its_colours(tmp_path):
    """Red and blue are those of its COLLADA meshes."""
    description = RosArm().write(tmp_path)
    mesh = description.parents[1] / "meshes" / "shell.dae"
    mesh.write_text(painted_dae(("1 0 0", "0 0 1")))
    file = tmp_path / "mine.yaml"
    text = PRESSED.format(file=description.relative_to(tmp_path)).replace("1.5", "0.05")
    file.write_text(text)
    arguments = ["--scenario", str(file), "--out", str(tmp_path / "out"), "--no-figures", "--html"]
    assert main(["run", *arguments]) == 0
    with visit(tmp_path / "out" / "replay.html") as visited:
        for colour in ("ff0000", "0000ff"):
            visited.page.wait_for_function(HAS_COLOUR, arg=["mine", colour], timeout=5000)
    assert visited.errors == []


def test_a_robot_file_that_is_not_there_is_named(tmp_path, capsys):
    file = tmp_path / "mine.yaml"
    file.write_text(PRESSED.format(file="nowhere.urdf"))
    assert main(["run", "--scenario", str(file), "--out", str(tmp_path / "out")]) == 2
    assert "nowhere.urdf" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
