"""Without its extra, each use of one is one line that says what to install.

The imports are blocked here; no environment is made for it.
"""

import re
import shutil
import sys
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from library_tree import PYPROJECT, ROOT
from published_arms import RosArm
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import Adder

import geoimp_drake
from geoimp_drake import cli
from geoimp_drake.compilation import compiled
from geoimp_drake.errors import MissingPackageError
from geoimp_drake.extras import needs_extra
from geoimp_drake.models import model_path
from geoimp_drake.motion_program import pdl
from geoimp_drake.parts import quadratic_program
from geoimp_drake.robot_files.loading import load_robot
from geoimp_drake.simulation.notebook import show_diagram

EXTRAS = PYPROJECT["project"]["optional-dependencies"]
# Sphinx's own command is missing without the first; the second is a developer's.
OF_NO_CODE = {"docs", "test"}

COMMANDS = {
    "franka": "drive mine.yaml --dry-run",
    "mujoco": "run consistency --simulator mujoco --out out",
    "pdl": "run peg_in_hole --out out",
    "report": "reproduce --out out",
    "sweep": "sweep plexiglas --vary surface.properties.mount_stiffness=9e3:1e4 --out out",
    "tune": "tune plexiglas --out out",
}
FRANKA = """
experiment: custom
robot:
  file: arm.urdf
  end_effector: flange
  geometry: leave-out
  driver: { kind: franka, address: 172.16.0.2 }
segments: [{ duration: 1.0 }]
"""


def load_meshes() -> None:
    load_robot(RosArm().write(Path.cwd()), MultibodyPlant(1e-3), end_effector="tool0")


def show_a_diagram() -> None:
    builder = DiagramBuilder()
    builder.AddSystem(Adder(1, 1))
    print(show_diagram(builder.Build()))


CALLS = {"data": lambda: geoimp_drake.load_log("log.npz"), "robots": load_meshes}
# These go on without, slower or in words.
INSTEAD = {
    "fast": compiled.is_available,
    "limits": quadratic_program._solver,
    "notebooks": show_a_diagram,
}


def modules_of(extra: str) -> set[str]:
    """What the extra's own packages are imported as."""
    names = {re.split(r"[\[<>=;]", text)[0] for text in EXTRAS[extra]} - {"geoimp-drake"}
    owners = packages_distributions().items()
    return {module for module, owned in owners if names & {name.lower() for name in owned}}


@pytest.fixture
def without(monkeypatch, tmp_path):
    """Blocks an extra's imports, in an empty folder; nothing remembers that it is there."""
    kept = (compiled._is_installed, quadratic_program._solver, pdl._parser)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))

    def block(extra: str) -> None:
        for function in kept:
            function.cache_clear()
        for module in modules_of(extra):
            monkeypatch.setitem(sys.modules, module, None)

    yield block
    for function in kept:
        function.cache_clear()


def test_every_extra_is_tried_and_described():
    assert {*COMMANDS, *CALLS, *INSTEAD} == EXTRAS.keys() - OF_NO_CODE
    rows = re.findall(
        r"^\| `(\w+)` \|", (ROOT / "docs" / "start.md").read_text("utf-8"), re.MULTILINE
    )
    assert {*rows} == EXTRAS.keys() - {"test"}


@pytest.mark.parametrize("extra", COMMANDS)
def test_a_command_without_its_extra_ends_with_one_line(extra, without, capsys):
    without(extra)
    shutil.copy(model_path("six_joint_arm"), "arm.urdf")
    Path("mine.yaml").write_text(FRANKA, encoding="utf-8")
    assert cli.main(COMMANDS[extra].split()) == 1
    error = capsys.readouterr().err.splitlines()[-1]
    assert re.search(rf"geoimp: .* needs the package \w+: {asked(extra)}$", error)
    assert not Path("out").exists()


@pytest.mark.parametrize("extra", CALLS)
def test_a_call_without_its_extra_is_an_error_of_one_line(extra, without):
    without(extra)
    with pytest.raises(MissingPackageError, match=rf"needs the package \w+: {asked(extra)}"):
        CALLS[extra]()


@pytest.mark.parametrize("extra", INSTEAD)
def test_what_goes_on_without_its_extra_says_so(extra, without, caplog, capsys):
    without(extra)
    INSTEAD[extra]()
    assert len(re.findall(asked(extra), caplog.text + capsys.readouterr().out)) == 1


def asked(extra: str) -> str:
    """What the reader is asked to do, as a pattern."""
    return re.escape(f"pip install 'geoimp-drake[{extra}]'.")


def test_an_extra_that_is_there_and_fails_tells_why():
    with pytest.raises(MissingPackageError) as told, needs_extra("data", "A log"):
        raise ImportError("libhdf5.so: no such\nfile")
    assert str(told.value) == (
        "A log needs what fails (libhdf5.so: no such file): pip install 'geoimp-drake[data]'."
    )
