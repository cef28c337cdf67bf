"""A user whose home cannot be written to has caches all the same, and is told once where."""

import os
import subprocess
import sys
import tempfile

import pytest

from geoimp_drake.cli.caches import keep_caches

NOWHERE = "/dev/null/home"  # for root, too


@pytest.fixture
def environment(monkeypatch, tmp_path):
    """The environment of a user without a home, and of whom nothing is told of caches."""
    kept = {k: v for k, v in os.environ.items() if k not in ("XDG_CACHE_HOME", "MPLCONFIGDIR")}
    monkeypatch.setattr(os, "environ", kept | {"HOME": NOWHERE})
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return os.environ


def test_a_run_says_one_line_and_keeps_caches_for_the_next(environment, tmp_path):
    """Without the line matplotlib warns, and each process draws up its list of fonts anew."""
    command = ["run", "plexiglas", "--duration", "0.01", "--out"]
    done = subprocess.run(
        [sys.executable, "-m", "geoimp_drake.cli", *command, tmp_path / "out"],
        env=environment | {"TMPDIR": str(tmp_path), "GEOIMP_COMPILED": "0"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    (line,) = done.stderr.splitlines()
    (folder,) = tmp_path.glob("geoimp_drake-*")
    assert line == f"Caches are kept in {folder}: the home cannot be written to."
    assert (folder / "matplotlib").is_dir()


def test_a_home_that_takes_them_is_left_alone(environment, tmp_path, caplog):
    environment["HOME"] = str(tmp_path)
    keep_caches()
    assert not {"XDG_CACHE_HOME", "MPLCONFIGDIR"} & environment.keys()
    assert not caplog.records


@pytest.mark.parametrize("kind", ["open to all", "a link"])
def test_a_folder_that_others_can_write_to_is_not_used(environment, tmp_path, kind):
    """What is in it is run as machine code."""
    folder = tmp_path / f"geoimp_drake-{os.getuid()}"
    if kind == "a link":
        (tmp_path / "private").mkdir(mode=0o700)
        folder.symlink_to(tmp_path / "private")
    else:
        folder.mkdir()
        folder.chmod(0o777)
    keep_caches()
    assert "XDG_CACHE_HOME" not in environment
