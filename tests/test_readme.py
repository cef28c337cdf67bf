"""The README is true: its Python runs as printed, its commands and its paths exist."""

import re
import shlex
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from library_tree import ROOT
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import WeldJoint
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake import cli
from geoimp_drake.models import model_path

README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = (*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"))

# A posture in which the arm reaches forward and its hand points down [rad].
POSTURE = np.array([0.1225, -0.3789, 1.0966, 0.0, -0.7177, -1.4483])


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.DOTALL | re.MULTILINE)


def commands(program: str) -> list[list[str]]:
    """Arguments of every call of a program in the README's shell blocks."""
    lines = chain.from_iterable(block.splitlines() for block in blocks("sh"))
    split = (shlex.split(line, comments=True) for line in lines)
    return [words[1:] for words in split if words and Path(words[0]).name == program]


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
    (code,) = blocks("python")
    names = prepared_plant()
    exec(compile(code, "README.md", "exec"), names)
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


def test_every_block_of_the_documents_is_tested():
    with_python = {page.name for page in PAGES if "```python" in page.read_text("utf-8")}
    assert with_python == {"README.md"}
    languages = re.findall(r"^```(\w+)$", README, re.MULTILINE)
    assert sorted(languages) == ["python", "sh", "sh"]
    lines = chain.from_iterable(block.splitlines() for block in blocks("sh"))
    tried = [*commands("make"), *commands("geoimp")]
    assert len([line for line in lines if line.strip()]) == len(tried) > 0


@pytest.mark.parametrize("arguments", commands("make"), ids=" ".join)
def test_make_has_the_targets_of_the_readme(arguments):
    targets = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    assert arguments
    assert set(arguments) <= set(targets)


def runs() -> list[list[str]]:
    return [arguments for arguments in commands("geoimp") if arguments[0] == "run"]


@pytest.mark.parametrize(
    "arguments", [c for c in commands("geoimp") if c[0] != "run"], ids=" ".join
)
def test_commands_of_the_readme_are_understood(arguments):
    assert callable(cli._parser().parse_args(arguments).command)


@pytest.mark.parametrize("arguments", runs(), ids=" ".join)
def test_runs_of_the_readme_write_the_files_it_lists(arguments, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("my.yaml").write_text("start: {tilt_deg: 7.0}\n", encoding="utf-8")
    assert cli.main([*arguments, "--duration", "0.01"]) == 0
    listed = set(re.findall(r"^\| `([\w.]+\.\w+)` \|", README, re.MULTILINE))
    expected = listed if "--html" in arguments else listed - {"replay.html"}
    files = (tmp_path / "results" / arguments[1]).iterdir()
    # The README's N stands for the figure's number in the chapter.
    written = {re.sub(r"(?<=figure_5_)\d+", "N", path.name) for path in files}
    assert written == expected


def links(page: Path) -> set[str]:
    targets = re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8"))
    return {target.partition("#")[0] for target in targets if "://" not in target}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_to_files(page):
    assert {target for target in links(page) if not (page.parent / target).exists()} == set()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_paths_in_the_text_exist(page):
    """Whatever is set as code and has a slash in it names files of the project."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    paths = set(re.findall(r"`([\w.*-]+/[\w./*-]*)`", text))
    assert {path for path in paths if not any(ROOT.glob(path.rstrip("/")))} == set()
