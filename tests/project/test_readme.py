"""The README is true: its Python runs as printed, its commands, scenario and results exist."""

import re
import shutil
import subprocess
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from documents import README, blocks, commands, execute
from library_tree import PYPROJECT
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import WeldJoint
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

import geoimp_drake
from geoimp_drake import cli
from geoimp_drake.models import model_path
from geoimp_drake.robots.driver_config import DriverConfig
from geoimp_drake.scenario.yaml_text import parse_yaml

# A posture in which the arm reaches forward and its hand points down [rad].
POSTURE = np.array([0.1225, -0.3789, 1.0966, 0.0, -0.7177, -1.4483])

VALIDATION = README.parent / "docs" / "validation" / "index.md"


def prepared_plant() -> dict:
    """What the README says that its reader has: a plant with an arm and a weld joint `wrist`."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    (arm,) = Parser(plant).AddModels(model_path("six_joint_arm"))
    (tool,) = Parser(plant).AddModels(model_path("stick_and_disk"))
    flange, E = plant.GetFrameByName("flange", arm), plant.GetFrameByName("disk", tool)
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base", arm))
    tool_frame = plant.GetBodyByName("tool", tool).body_frame()
    plant.AddJoint(WeldJoint("wrist", flange, tool_frame, RigidTransform()))
    plant.Finalize()
    plant.SetDefaultPositions(arm, POSTURE)
    return {"builder": builder, "plant": plant, "arm": arm, "E": E}


def test_python_of_the_readme_makes_a_controller_that_moves_E_as_desired():
    (block,) = [block for block in blocks(README) if block.language == "python"]
    names = prepared_plant()
    exec(compile(block.text, "README.md", "exec"), names)
    plant, E, desired = names["plant"], names["E"], names["desired"]
    simulator = Simulator(names["builder"].Build())

    def position():
        context = plant.GetMyContextFromRoot(simulator.get_context())
        return E.CalcPoseInWorld(context).translation()

    start = position()
    simulator.AdvanceTo(0.5)
    moved = position() - start
    wanted = desired.evaluate(0.5)[4:7] - start
    assert wanted[2] < -0.004
    np.testing.assert_allclose(wanted[:2], 0.0, atol=1e-12)
    np.testing.assert_allclose(moved, wanted, atol=0.05 * abs(wanted[2]))


def test_every_line_of_a_shell_block_is_tested():
    (yaml,) = (block for block in blocks(README) if block.language == "yaml")
    assert yaml.text.startswith("# franka.yaml\n")
    assert len(yaml.text.splitlines()) <= 6
    assert max(map(len, yaml.text.splitlines())) <= 120
    assert {block.language for block in blocks(README)} == {"python", "sh", "yaml"}
    assert commands(README, "geoimp") == [["drive", "franka.yaml", "--dry-run"]]
    lines = [line for b in blocks(README) if b.language == "sh" for line in b.text.splitlines()]
    others = [line for line in lines if not line.startswith("geoimp")]
    assert len(others) == 3
    for line in others:
        execute(line)


def test_the_scenario_of_a_franka_can_be_driven(tmp_path, monkeypatch, capsys):
    """Its plant stands for the robot: the same scenario, configuration and joints."""
    monkeypatch.chdir(tmp_path)
    pytest.importorskip("franky_sim", reason="only for Linux")
    shutil.copy(files("franky_sim") / "assets" / "fr3.urdf", "fr3.urdf")
    (yaml,) = (block.text for block in blocks(README) if block.language == "yaml")
    Path("franka.yaml").write_text(yaml, encoding="utf-8")
    (command,) = commands(README, "geoimp")
    assert cli.main([*command, "--set", "robot.driver={kind: plant}"]) == 0
    printed = re.findall(r"^(fr3_joint\d) +q .* torque ", capsys.readouterr().out, re.MULTILINE)
    assert printed == [f"fr3_joint{k}" for k in range(1, 8)]
    DriverConfig(**parse_yaml(yaml, "franka.yaml")["robot"]["driver"]).validate("robot.driver")


def test_on_pypi_its_pictures_and_links_are_those_of_the_release():
    make = ["make", "--silent", "pypi-readme"]
    text = subprocess.check_output(make, cwd=README.parent, text=True)
    release = f"{PYPROJECT['project']['urls']['Repository']}/%s/v{geoimp_drake.__version__}/"
    found = re.findall(r"(!?)\[[^]]*\]\(([^)#]+)", text)
    ours = [(mark, path) for mark, path in found if "drake.mit.edu" not in path]
    addresses = {"!": release % "raw", "": release % "blob"}
    assert [path for mark, path in ours if not path.startswith(addresses[mark])] == []
    paths = [path.removeprefix(addresses[mark]) for mark, path in ours]
    assert [path for path in paths if not (README.parent / path).exists()] == []
    assert [mark for mark, _ in ours].count("!") == 2


def test_results_of_the_readme_are_those_of_the_validation():
    shown, all_of_them = (results(page) for page in (README, VALIDATION))
    assert len(shown) > 4
    assert shown <= all_of_them


def results(page: Path) -> set[tuple[str, ...]]:
    """The experiment, claim, value and bound of each row; a row without a name is of the last."""
    text = page.read_text(encoding="utf-8")
    table = text[text.index("| experiment | claim | value") :].partition("\n\n")[0]
    rows, name = set(), ""
    for line in table.splitlines()[2:]:
        first, *others = (cell.strip() for cell in line.strip("|").split("|"))
        name = first or name
        rows.add((name, *others))
    return rows
