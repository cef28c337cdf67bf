"""The archives of a release and fresh environments to try them in, outside of this one."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from library_tree import ROOT

NO_SOURCE = (".*", "__pycache__", "*.egg-info", "build", "dist", "results")


def run(*command: str | Path, cwd: Path, **environment: str) -> str:
    """Runs a command as a user would, outside of this test's environment; returns its output."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL_ENV"))}
    done = subprocess.run(
        list(map(str, command)), cwd=cwd, env=kept | environment, text=True, capture_output=True
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def build_archives(folder: Path) -> Path:
    """Builds the source archive and the wheel from it, not from the tree; returns the wheel."""
    copy = folder / "copy"
    shutil.copytree(ROOT, copy, symlinks=True, ignore=shutil.ignore_patterns(*NO_SOURCE))
    run(sys.executable, "-m", "build", "--outdir", folder, copy, cwd=folder)
    (wheel,) = folder.glob("*.whl")
    return wheel


def new_environment(folder: Path, base: str, requirement: str) -> Path:
    """Makes an environment that has a requirement; returns its Python."""
    run(base, "-m", "venv", "--without-pip", folder / "venv", cwd=folder)
    python = folder / "venv" / "bin" / "python"
    run(*pip_of(python), "install", "--no-compile", requirement, cwd=folder)
    return python


def pip_of(python: Path) -> tuple[str | Path, ...]:
    """Returns the command of this environment's pip, which works on another one."""
    return sys.executable, "-m", "pip", "--python", python
