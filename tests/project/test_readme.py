"""The README is true: its Python runs as printed, its commands and its paths exist."""

import re
from pathlib import Path

import numpy as np
import pytest
from documents import README, blocks, commands, execute, make_targets, shortened
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import WeldJoint
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake import cli
from geoimp_drake.models import model_path

# A posture in which the arm reaches forward and its hand points down [rad].
POSTURE = np.array([0.1225, -0.3789, 1.0966, 0.0, -0.7177, -1.4483])

RUNS = [arguments for arguments in commands(README, "geoimp") if arguments[0] == "run"]
LINES = [line for b in blocks(README) if b.language == "sh" for line in b.text.splitlines()]


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


def test_every_block_of_the_readme_is_tested():
    assert {block.language for block in blocks(README)} == {"python", "sh"}
    tried = [*commands(README, "make"), *commands(README, "geoimp")]
    assert len([line for line in LINES if line.strip()]) == len(tried) > 0


@pytest.mark.parametrize("arguments", commands(README, "make"), ids=" ".join)
def test_make_has_the_targets_of_the_readme(arguments):
    assert arguments
    assert set(arguments) <= make_targets()


@pytest.mark.parametrize("line", [x for x in LINES if "geoimp" in x and " run " not in x])
def test_other_commands_of_the_readme_run(line, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "models").symlink_to(README.parent / "models")
    execute(line)


@pytest.mark.parametrize("arguments", RUNS, ids=" ".join)
def test_runs_of_the_readme_write_the_files_it_lists(arguments, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("my.yaml").write_text("start: {tilt_deg: 7.0}\n", encoding="utf-8")
    assert cli.main(shortened(arguments)) == 0
    text = README.read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`\w+\.\w+`(?:, `\w+\.\w+`)*) \|", text, re.MULTILINE)
    listed = {name.strip("`") for row in rows for name in row.split(", ")}
    expected = listed if "--html" in arguments else listed - {"replay.html"}
    files = (tmp_path / "results" / arguments[1]).iterdir()
    # The README's N stands for the figure's number in the chapter.
    written = {re.sub(r"(?<=figure_5_)\d+", "N", path.name) for path in files}
    assert written == expected
