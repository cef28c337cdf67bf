"""A robot from a file on the command line: looked at, checked, and moving after two commands."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from geoimp_drake.cli import main
from geoimp_drake.models import model_path
from geoimp_drake.systems.frame_motion import POSITION

CASES = Path(__file__).parent / "robot_files" / "cases"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """A folder of the user's with robots in it."""
    for file in CASES.glob("*.urdf"):
        shutil.copy(file, tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("robot", ["light6", "light7"])
def test_a_robot_moves_after_two_commands_and_its_impedance_is_there(robot, folder, capsys):
    """At rest under the push the hand has given way by F / K, and nothing moves any more."""
    assert main(["init", f"{robot}.yaml", "--robot", f"{robot}.urdf"]) == 0
    assert "nothing to warn of" in capsys.readouterr().out
    assert main(["run", "--scenario", f"{robot}.yaml", "--no-figures"]) == 0
    out = folder / "results" / robot
    claims = json.loads((out / "metrics.json").read_text("utf-8"))["claims"]
    assert {claim["claim"]: claim for claim in claims if claim["holds"] is False} == {}
    scenario = yaml.safe_load((folder / f"{robot}.yaml").read_text("utf-8"))
    log = np.load(out / "log.npz")
    D, E = (log[f"arm/motion_{frame}"][:, POSITION] for frame in "DE")
    moved = np.linalg.norm(D - D[0], axis=1).max()
    assert moved == pytest.approx(np.linalg.norm(scenario["segments"][0]["displacement"]))
    force = np.array(scenario["external"]["force"])
    stiffness = scenario["impedance"]["translation"]["stiffness"]
    np.testing.assert_allclose(E[-1] - D[-1], force / stiffness, atol=2e-5)
    assert np.abs(log["arm/v"][-100:]).max() < 1e-3


def test_what_is_written_says_what_the_robot_is_and_finds_its_file(folder, capsys):
    """The scenario is for any folder, as long as the robot goes with it."""
    assert main(["init", "--robot", "light6.urdf"]) == 0
    printed = capsys.readouterr().out
    assert "light6.urdf: 4.7 kg move on 6 joints, j1, j2, j3, j4, j5, j6" in printed
    assert "frames: base, l1, l2, l3, l4, l5, l6" in printed
    assert "wrist sensor put between joint j6 and link l6" in printed
    text = (folder / "light6.yaml").read_text("utf-8")
    assert "# end effector: l6; six joints also move: none\n" in text
    scenario = yaml.safe_load(text)
    assert scenario["robot"]["file"] == "light6.urdf"
    assert scenario["duration"] is None  # as long as its motion, also when that is edited
    assert not re.search(r"-0\.0\b", text)
    (folder / "other").mkdir()
    assert main(["init", "other/light6.yaml", "--robot", "light6.urdf"]) == 0
    assert yaml.safe_load((folder / "other" / "light6.yaml").read_text("utf-8"))["robot"][
        "file"
    ] == str(folder / "light6.urdf")


def test_another_end_effector_can_be_named(folder, capsys):
    robot = str(model_path("six_joint_arm"))
    assert main(["init", "mine.yaml", "--robot", robot, "--end-effector", "link6"]) == 0
    assert "end effector: link6; six joints also move: flange" in capsys.readouterr().out
    assert (
        yaml.safe_load((folder / "mine.yaml").read_text("utf-8"))["robot"]["end_effector"]
        == "link6"
    )


def test_check_says_of_a_robot_and_of_a_scenario_what_a_run_would_warn_of(folder, capsys, caplog):
    """Balls of 100 mm, 160 mm apart at the farthest, and an arm that gravity pulls down."""
    touching = (folder / "spheres.urdf").read_text().replace('radius="0.03"', 'radius="0.1"')
    (folder / "touching.urdf").write_text(touching.replace('effort="100"', 'effort="0.4"'))
    assert main(["check", "touching.urdf"]) == 0
    of_robot = capsys.readouterr().out
    assert "touching.urdf: 12 kg move on 6 joints" in of_robot
    assert re.search("^warning: Links touch in every one of .*: l4 and l6", of_robot, re.MULTILINE)
    assert re.search("^warning: The start cannot be held: .*'j2'", of_robot, re.MULTILINE)
    assert list(folder.glob("*.yaml")) == []

    scenario = {
        "experiment": "custom",
        "robot": {"file": "touching.urdf", "end_effector": "l6", "geometry": "convert"},
        "start": {"posture": [0.0, 0.0, 0.3, 0.3, 1.0, 0.0]},
        "duration": 0.01,
    }
    (folder / "mine.yaml").write_text(yaml.safe_dump(scenario))
    assert main(["check", "mine.yaml"]) == 0
    of_scenario = capsys.readouterr().out
    assert "wrist sensor put between joint j6 and link l6" in of_scenario
    warnings = re.findall("^warning: (.*)$", of_scenario, re.MULTILINE)
    assert len(warnings) > 2
    assert main(["run", "--scenario", "mine.yaml", "--set", "plant.contact_model=point"]) == 0
    assert set(warnings) <= {record.getMessage() for record in caplog.records}


def test_a_robot_whose_meshes_are_missing_is_checked_and_begun_without(folder, capsys):
    text = (folder / "light6.urdf").read_text()
    shape = '<visual><geometry><mesh filename="package://away/l.stl"/></geometry></visual>'
    (folder / "bare.urdf").write_text(text.replace('<link name="l1">', f'<link name="l1">{shape}'))
    assert main(["check", "bare.urdf"]) == 0
    assert re.search("^warning: .*package 'away'", capsys.readouterr().out, re.MULTILINE)
    assert main(["init", "--robot", "bare.urdf"]) == 0
    assert yaml.safe_load((folder / "bare.yaml").read_text())["robot"]["geometry"] == "leave-out"
    assert main(["check", "bare.yaml"]) == 0


def test_a_package_that_lies_elsewhere_is_named_on_the_command_line(folder, capsys):
    """A link without mass has its inertia from a mesh in it, so the file is of no use without."""
    (folder / "elsewhere" / "meshes").mkdir(parents=True)
    shutil.copy(CASES / "tetra.stl", folder / "elsewhere" / "meshes")
    address = "package://the_arm/meshes/tetra.stl"
    shape = f'<collision><geometry><mesh filename="{address}"/></geometry></collision>'
    text = (folder / "light6.urdf").read_text("utf-8")
    bare = re.sub(r'(<link name="l4">).*?(</link>)', rf"\1{shape}\2", text, flags=re.DOTALL)
    (folder / "bare.urdf").write_text(bare, encoding="utf-8")
    assert main(["check", "bare.urdf"]) == 2
    assert "Give its folder" in capsys.readouterr().err
    line = ["--package", "the_arm=elsewhere"]
    assert main(["check", "bare.urdf", *line]) == 0
    assert main(["init", "bare.yaml", "--robot", "bare.urdf", *line]) == 0
    assert main(["check", "bare.yaml"]) == 0
    scenario = yaml.safe_load((folder / "bare.yaml").read_text("utf-8"))
    assert scenario["robot"]["packages"] == {"the_arm": "elsewhere"}
    assert main(["check", "bare.urdf", "--package", "elsewhere"]) == 2
    assert "'elsewhere'; give NAME=FOLDER" in capsys.readouterr().err


def test_an_arm_with_an_inertia_that_no_body_has_is_begun_with_its_repair(folder, capsys):
    text = (folder / "light6.urdf").read_text().replace('izz="0.004"', 'izz="0.1"', 1)
    (folder / "odd.urdf").write_text(text)
    assert main(["init", "--robot", "odd.urdf"]) == 0
    assert re.search("^warning: .*l1.*inertia 'repair'", capsys.readouterr().out, re.MULTILINE)
    assert yaml.safe_load((folder / "odd.yaml").read_text())["robot"]["inertia"] == "repair"


def test_warnings_name_the_users_file_and_come_once_a_kind(folder, capsys):
    limit = "<safety_controller k_velocity='1'/><limit"
    text = (folder / "light6.urdf").read_text().replace("<limit", limit)
    (folder / "careful.urdf").write_text(text)
    assert main(["check", "careful.urdf"]) == 0
    (warning,) = re.findall("^warning: .*", capsys.readouterr().out, re.MULTILINE)
    assert re.search(r"careful\.urdf:\d+: .*'safety_controller'.*first of 6", warning)


WARNED = {
    # A gain of the null-space motion that the controller's period does not bear.
    "K_n of the null-space motion is too large": {"redundancy": {"K_n": 200.0}},
    # The same where it is known with the torques.
    "K_n .* too large at t = 0": {"redundancy": {"K_n": 200.0}, "form": "compiled"},
    # Most of the last joint's inertia lies beyond the sensor, where a link has been cut.
    "inertia": {"sensor": {"inertial_load": "none"}},
}


@pytest.mark.parametrize("warning", WARNED)
def test_what_building_and_the_first_step_show_is_found(warning, folder, capsys):
    assert main(["init", "--robot", "light7.urdf"]) == 0
    assert "nothing to warn of" in capsys.readouterr().out
    scenario = {**yaml.safe_load((folder / "light7.yaml").read_text()), **WARNED[warning]}
    (folder / "changed.yaml").write_text(yaml.safe_dump(scenario))
    assert main(["check", "changed.yaml"]) == 0
    assert re.search(f"^warning: .*{warning}", capsys.readouterr().out, re.MULTILINE)


def test_what_cannot_start_is_unusable(folder, capsys):
    """Euler angles in their singularity: the first sample already has no derivative."""
    scenario = {
        "experiment": "custom",
        "start": {"attitude_deg": [0, 89.99, 0], "position": [1.0, 0.0, 0.9]},
        "impedance": {"orientation": "classical-euler"},
        "duration": 1.0,
    }
    (folder / "singular.yaml").write_text(yaml.safe_dump(scenario))
    assert main(["check", "singular.yaml"]) == 2
    assert re.search("^geoimp: .*classical-euler", capsys.readouterr().err)


UNUSABLE = {
    "init --robot nowhere.urdf": "nowhere.urdf",
    "init there.yaml --robot light6.urdf": "there.yaml is there already",
    "init there.yaml": "there.yaml is there already",
    "init new.yaml --robot light6.urdf --end-effector l9": "Unknown frame 'l9'.*Valid: base, l1",
    "init new.yaml --robot light6.urdf --end-effector l5": "has 5 joints.*needs at least 6",
    "init new.yaml --robot five.urdf": "longest chain has 5 moving joints.*needs 6",
    "init nowhere/new.yaml --robot light6.urdf": "nowhere/new.yaml cannot be written",
    "init new.yaml --robot light6.urdf --from bar": "--robot and --from exclude each other",
    "init new.yaml --end-effector l6": "--end-effector",
    "init": "Name the file to write",
    "init new.yaml --robot there.yaml": "is not XML",
    "check nowhere.urdf": "nowhere.urdf",
    "check nowhere.yaml": "nowhere.yaml",
    "check there.yaml --end-effector l6": "--end-effector and --package are for a robot's file",
    "check there.yaml": "does not name its experiment",
    "check .": "cannot be read",
    "check": "required: FILE",
}


@pytest.mark.parametrize("line", UNUSABLE)
def test_unusable_input_gets_one_line_and_leaves_nothing(line, folder, capsys):
    (folder / "there.yaml").write_text("seed: 1\n")
    text = (folder / "light6.urdf").read_text()
    (folder / "five.urdf").write_text(
        text.replace('name="j6" type="revolute"', 'name="j6" type="fixed"')
    )
    before = sorted(folder.iterdir())
    try:
        status = main(line.split())
    except SystemExit as stop:
        status = stop.code
    assert status == 2
    said = capsys.readouterr()
    assert re.search(UNUSABLE[line], said.err), said.err
    assert said.err.startswith("geoimp: ")
    assert said.err.count("\n") == 1
    assert said.out == ""
    assert sorted(folder.iterdir()) == before
