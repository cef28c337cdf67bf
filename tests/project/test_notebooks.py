"""Every notebook runs from top to bottom and is kept as a reader should find it.

The notebooks run unchanged, in an empty folder. As in a cloud notebook, the interpreter has only
the wheel with the extras that their first cell names. Warnings of Drake's deprecations, and any of
a notebook's own cells, are errors.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from archives import build_archives, new_environment
from jupyter_client import AsyncKernelManager
from jupyter_client.kernelspec import KernelSpec
from library_tree import PYPROJECT, ROOT
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbformat.v4 import new_code_cell, new_notebook

NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
MOST_CELLS = 25

# The first cell of each: a cloud notebook has nothing of it, here it does nothing.
EXTRAS = "fast,limits,notebooks"
INSTALL = f"""\
from importlib.util import find_spec

if find_spec("geoimp_drake") is None:  # in a cloud notebook
    %pip install --quiet "geoimp-drake[{EXTRAS}]"\
"""

every_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)

STRICT = """
import warnings
from pydrake.common.deprecation import DrakeDeprecationWarning
warnings.filterwarnings("error", category=DrakeDeprecationWarning)
warnings.filterwarnings("error", module="__main__")
"""

# All of the mathematics that the notebooks may use; KaTeX, and so GitHub and Jupyter, knows it.
KATEX = set(
    re.findall(
        r"\w+",
        """
        Delta Gamma Lambda Omega alpha beta delta epsilon eta gamma lambda mu omega pi psi varphi
        vartheta xi zeta cos sin tan max approx cdot dagger geq leq partial times ddot dot frac sqrt
        sum left right quad qquad text
        """,
    )
)
MATHS = re.compile(r"\$\$(.+?)\$\$|\$(.+?)\$", re.DOTALL)


@pytest.fixture(scope="session")
def kernel(tmp_path_factory):
    """A manager of kernels of a fresh environment, whatever kernels are installed."""
    folder = tmp_path_factory.mktemp("notebooks")
    wheel = build_archives(folder)
    python = new_environment(folder, sys.executable, f"{wheel}[{EXTRAS}]")
    started = [str(python), "-m", "ipykernel_launcher", "-f", "{connection_file}"]

    class FreshInterpreter(AsyncKernelManager):
        @property
        def kernel_spec(self):
            return KernelSpec(argv=started, language="python", display_name="fresh")

    yield FreshInterpreter
    shutil.rmtree(folder)  # a gigabyte, which pytest would keep for three runs


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder to run in, with nothing of the user's own configuration of IPython."""
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    monkeypatch.setenv("JUPYTER_CONFIG_DIR", str(tmp_path / "jupyter"))
    monkeypatch.setenv("JUPYTER_RUNTIME_DIR", str(tmp_path / "runtime"))
    monkeypatch.delenv("PYTHONPATH", raising=False)
    monkeypatch.setenv("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    work = tmp_path / "work"
    work.mkdir()
    return work


def read(path):
    return nbformat.read(path, as_version=nbformat.NO_CONVERT)


def sources(notebook, kind):
    return [cell.source for cell in notebook.cells if cell.cell_type == kind]


def execute(notebook, folder, kernel):
    """Executes a notebook's cells, strict about warnings; returns it with its outputs."""
    strict = new_notebook(cells=[new_code_cell(STRICT), *notebook.cells])
    client = NotebookClient(
        strict,
        timeout=300,
        kernel_manager_class=kernel,
        resources={"metadata": {"path": str(folder)}},
    )
    client.execute()
    return strict


def kinds_of_output(notebook):
    outputs = [out for cell in notebook.cells for out in cell.get("outputs", [])]
    return {kind for out in outputs for kind in out.get("data", {})}


@every_notebook
def test_runs_from_top_to_bottom(path, folder, kernel):
    done = execute(read(path), folder, kernel)
    # A block diagram, figures and a scene in Meshcat have been shown.
    assert {"image/svg+xml", "image/png", "text/html"} <= kinds_of_output(done)
    texts = [out.text for cell in done.cells for out in cell.get("outputs", []) if "text" in out]
    assert not [text for text in texts if "Warning" in text]
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(
    "code",
    [
        "1 / 0",
        "import warnings; warnings.warn('of the cell itself')",
        "from pydrake.common.deprecation import DrakeDeprecationWarning\n"
        "warnings.warn_explicit('old', DrakeDeprecationWarning, 'somewhere.py', 1)",
    ],
)
def test_a_failing_cell_or_a_warning_fails_the_notebook(code, folder, kernel):
    with pytest.raises(CellExecutionError):
        execute(new_notebook(cells=[new_code_cell(code)]), folder, kernel)


@every_notebook
def test_is_kept_without_outputs(path):
    notebook = read(path)
    nbformat.validate(notebook)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert not [cell for cell in code if cell.outputs or cell.execution_count is not None]
    assert {"kernelspec", "language_info"} >= set(notebook.metadata)
    assert notebook.metadata.language_info == {"name": "python"}


@every_notebook
def test_has_one_title_with_its_number_and_not_too_many_cells(path):
    notebook = read(path)
    titles = re.findall(r"^# .+$", "\n".join(sources(notebook, "markdown")), re.MULTILINE)
    assert len(titles) == 1
    assert notebook.cells[0].source.startswith(f"# {int(path.name[:2])}. ")
    assert len(notebook.cells) <= MOST_CELLS
    assert not [cell for cell in notebook.cells if not cell.source.strip()]


@every_notebook
def test_installs_what_it_needs_where_that_is_missing(path):
    assert sources(read(path), "code")[0] == INSTALL


@every_notebook
def test_names_no_place_of_this_machine(path):
    text = path.read_text(encoding="utf-8")
    assert not re.findall(r"(?:/home|/work|/tmp|/usr|/root|/Users|[A-Z]:\\\\)\b", text)


@every_notebook
def test_shows_what_it_builds_and_how_it_moves(path):
    code = "\n".join(sources(read(path), "code"))
    assert "show_diagram(" in code
    assert "show_meshcat(" in code


def faults_of_maths(text):
    """What KaTeX, or Markdown before it, would not take in the mathematics of a text."""
    faults, text = [], re.sub(r"`[^`]*`", "", text)
    if text.count("$") % 2:
        faults.append("a dollar without its partner")
    for display, inline in MATHS.findall(text):
        formula = display or inline
        faults += sorted(set(re.findall(r"\\([A-Za-z]+)", formula)) - KATEX)
        faults += [f"character {c}" for c in formula if not c.isascii()]
        if formula.count("{") != formula.count("}"):
            faults.append(f"braces of {formula}")
        if inline and (inline != inline.strip() or "\n" in inline):
            faults.append(f"space at the ends of, or lines in ${inline}$")
    return faults


@every_notebook
def test_mathematics_is_what_katex_knows(path):
    assert [f for text in sources(read(path), "markdown") for f in faults_of_maths(text)] == []


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        (r"$K_o = \frac{1}{2}$ and $$\ddot{x} + \xi$$", 0),
        (r"$\newcommand{\a}{b}$", 2),
        (r"costs 5 $", 1),
        (r"`$ARM_OVR` is no mathematics", 0),
        ("$ϑ$", 1),
        ("$x_{1$", 1),
        ("$ x$", 1),
    ],
)
def test_faults_of_mathematics_are_found(text, faults):
    assert len(faults_of_maths(text)) == faults


def test_ruff_checks_the_notebooks():
    """`make lint` checks all that ruff finds in the repository."""
    ruff = [sys.executable, "-m", "ruff"]
    shown = subprocess.run(
        [*ruff, "check", "--show-files", "."], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert set(NOTEBOOKS) <= {Path(line) for line in shown.stdout.splitlines()}
    for command in (["check"], ["format", "--check"]):
        done = subprocess.run(
            [*ruff, *command, *NOTEBOOKS], cwd=ROOT, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout


def test_extras_have_what_the_notebooks_need():
    extras = PYPROJECT["project"]["optional-dependencies"]
    notebooks, test = (
        {re.split("[>=]", text)[0] for text in extras[name]} for name in ("notebooks", "test")
    )
    assert notebooks >= {"jupyterlab", "pygraphviz"}
    assert test >= {"ipykernel", "nbclient", "pygraphviz"}


def test_markdown_and_code_alone():
    kinds = {cell.cell_type for path in NOTEBOOKS for cell in read(path).cells}
    assert kinds == {"code", "markdown"}
