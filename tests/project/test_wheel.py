"""The source archive, the wheel built from it, and the wheel alone in a fresh environment.

Needs a package index, as `make test` itself does. One worker does all of it, see the mark.
"""

import functools
import importlib.metadata
import json
import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Iterator
from email.message import Message
from pathlib import Path

import numpy as np
import pytest
from archives import build_archives, new_environment, pip_of, run
from library_tree import FOLDERS, MODULES, PYPROJECT, ROOT, files

# 3.11 gets the last Drake that supports it, the others the newest.
PYTHONS = ("3.11", "3.12", "3.13")
# Imported where numba is installed, which the extra `fast` brings.
WITH_NUMBA = {
    "geoimp_drake.compilation.kept_arguments",
    "geoimp_drake.compilation.machine_code",
    "geoimp_drake.compilation.small_array_operations",
    "geoimp_drake.compilation.small_array_type",
}


@pytest.fixture(scope="session")
def wheel(tmp_path_factory) -> Path:
    return build_archives(tmp_path_factory.mktemp("archives"))


@functools.cache
def interpreter(version: str) -> str | None:
    """A Python of that version that runs: this one, one on the path, or one of pyenv's."""
    if version == f"{sys.version_info.major}.{sys.version_info.minor}":
        return sys.executable
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    installed = sorted(pyenv.glob(f"versions/{version}.*/bin/python"))
    for candidate in (shutil.which(f"python{version}"), *map(str, installed)):
        # A shim on the path may lead nowhere: only a Python that answers is one.
        answer = subprocess.getoutput(f"{candidate} -I --version") if candidate else ""
        if answer.startswith(f"Python {version}."):
            return candidate
    return None


@pytest.fixture(scope="session", params=PYTHONS)
def python(request, wheel, tmp_path_factory) -> Iterator[Path]:
    """The Python of a fresh environment that has the wheel and what it requires, no extras."""
    base = interpreter(request.param)
    if base is None:
        pytest.skip(f"there is no Python {request.param} on this machine that runs")
    folder = tmp_path_factory.mktemp("environment")
    yield new_environment(folder, base, str(wheel))
    shutil.rmtree(folder)  # half a gigabyte, which pytest would keep for three runs


def test_wheel_holds_every_file_of_the_library_and_no_other(wheel):
    expected = {
        "/".join((*root.split("."), *path.relative_to(FOLDERS[root]).parts))
        for package, path in files()
        for root in [max((r for r in FOLDERS if f"{package}.".startswith(f"{r}.")), key=len)]
    }
    names = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    assert names == expected
    assert {"geoimp_drake/py.typed", "geoimp_drake/models/package.xml"} <= names


def test_files_in_the_wheel_are_those_of_the_tree(wheel):
    content = zipfile.ZipFile(wheel)
    for module, path in MODULES.items():
        name = module.replace(".", "/") + ("/__init__.py" if path.stem == "__init__" else ".py")
        assert content.read(name) == path.read_bytes(), name


def metadata_of(wheel: Path) -> Message:
    (distribution,) = importlib.metadata.distributions(path=[str(wheel)])
    return distribution.metadata


def test_metadata_are_those_declared(wheel):
    project, metadata = PYPROJECT["project"], metadata_of(wheel)
    for key, field in {
        "name": "Name",
        "description": "Summary",
        "license": "License-Expression",
    }.items():
        assert metadata[field] == project[key]
    assert metadata["Requires-Python"] == project["requires-python"]
    assert metadata["Description-Content-Type"].startswith("text/markdown")
    # The backport importlib_metadata, if something has imported it, keeps the text in a header.
    text = metadata.get_payload() or metadata["Description"]
    assert text.strip() == (ROOT / "README.md").read_text("utf-8").strip()
    assert set(metadata.get_all("Provides-Extra")) == set(project["optional-dependencies"])
    core = {text for text in metadata.get_all("Requires-Dist") if "extra ==" not in text}
    assert core == set(project["dependencies"])


@pytest.mark.parametrize("archive", ["wheel", "sdist"])
def test_licence_comes_along(wheel, archive):
    licence = (ROOT / "LICENSE").read_bytes()
    if archive == "wheel":
        content = zipfile.ZipFile(wheel)
        (name,) = [n for n in content.namelist() if n.endswith(".dist-info/licenses/LICENSE")]
        assert content.read(name) == licence
    else:
        (path,) = wheel.parent.glob("*.tar.gz")
        with tarfile.open(path) as content:
            assert (
                content.extractfile(f"{path.name.removesuffix('.tar.gz')}/LICENSE").read()
                == licence
            )


def test_environment_has_the_dependencies_and_none_of_the_extras(python, tmp_path):
    listed = json.loads(run(*pip_of(python), "list", "--format=json", cwd=tmp_path))
    installed = {package["name"].lower() for package in listed}
    assert {"drake", "geoimp-drake"} <= installed
    for extra in PYPROJECT["project"]["optional-dependencies"].values():
        assert not installed & {text.split(">")[0].lower() for text in extra}
    run(*pip_of(python), "check", cwd=tmp_path)


def test_every_module_is_imported_from_the_installed_wheel(python, tmp_path):
    code = (
        "import importlib, sys\n"
        "for name in sys.argv[1:]: print(importlib.import_module(name).__file__)"
    )
    modules = MODULES.keys() - WITH_NUMBA
    paths = run(python, "-W", "error", "-c", code, *sorted(modules), cwd=tmp_path).split()
    assert len(paths) == len(modules)
    outside = [path for path in paths if python.parents[1] not in Path(path).parents]
    assert not outside
    assert all("site-packages" in path for path in paths)


def test_an_experiment_runs_from_the_installed_wheel(python, wheel, tmp_path):
    out = tmp_path / "results"
    geoimp = python.with_name("geoimp")
    arguments = ("run", "plexiglas", "--duration", "0.2", "--out", out)
    run(geoimp, *arguments, cwd=tmp_path, PYTHONWARNINGS="error")
    written = {path.name for path in out.iterdir()}
    figures = {
        f"{name}.{kind}" for name in ("figure_5_3", "energy_audit") for kind in ("png", "pdf")
    }
    assert written == {"log.npz", "metrics.json", "scenario.yaml", *figures}
    assert np.load(out / "log.npz")["t"][-1] == pytest.approx(0.2)
    versions = json.loads((out / "metrics.json").read_text("utf-8"))["versions"]
    assert versions["geoimp_drake"] == metadata_of(wheel)["Version"]
    assert [path.name for path in tmp_path.iterdir()] == ["results"]
