"""Files of results: whole, in the folder that was named, never through a link in it.

What cannot be written is said before anything is computed; where a disk is full only then, what
found room is kept.
"""

import dataclasses
import errno
import json
import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from geoimp_drake import cli, output_folder
from geoimp_drake.campaigns import reproduce
from geoimp_drake.campaigns.journal import Finished
from geoimp_drake.compilation.compiled import is_available
from geoimp_drake.diagrams.experiments import reproduction
from geoimp_drake.errors import OutputError
from geoimp_drake.output_folder import write_file

RUN = ("run", "plexiglas", "--duration", "0.02", "--no-figures")
COMPARE = ("compare", "consistency", "--duration", "0.02", "--orientation", "quaternion")
SWEEP = ("sweep", "plexiglas", "--duration", "0.02", "--vary", "start.tilt_deg=0:1", "--jobs", "1")
REPRODUCE = ("reproduce", "--duration", "0.02", "--jobs", "1")
# Of each command something that it writes, at every depth.
WRITTEN = [
    *((RUN, name) for name in ("log.npz", "scenario.yaml", "metrics.json", "replay.html")),
    *((COMPARE, name) for name in ("comparison.json", "quaternion", "quaternion/log.npz")),
    *((SWEEP, name) for name in ("journal.jsonl", "samples.csv", "peak_forces.pdf")),
    *((REPRODUCE, name) for name in ("journal.jsonl", "report.html", "plexiglas")),
    *((REPRODUCE, f"bar/{name}") for name in ("comparison.png", "squeezed/figure_5_13.pdf")),
]


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """Lets laws be compiled, if they are, before anything is said in one line."""
    is_available()


@pytest.fixture
def out(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder


def contents(folder: Path) -> dict[str, bytes | str]:
    """Everything below a folder: the bytes of files, the targets of links."""
    return {
        str(path.relative_to(folder)): os.readlink(path) if path.is_symlink() else path.read_bytes()
        for path in folder.rglob("*")
        if path.is_symlink() or path.is_file()
    }


@pytest.mark.parametrize("target", ["precious", "missing", "folder"])
@pytest.mark.parametrize(
    ("command", "name"), WRITTEN, ids=lambda v: v if isinstance(v, str) else v[0]
)
def test_a_link_in_the_place_of_a_result_is_refused_before_anything_is_done(
    command, name, target, out, tmp_path, capsys
):
    (tmp_path / "precious").write_text("precious")
    (tmp_path / "folder").mkdir()
    (out / name).parent.mkdir(parents=True, exist_ok=True)
    (out / name).symlink_to(tmp_path / target)
    before = contents(tmp_path)
    assert cli.main([*command, "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert f"{out / name} cannot be written: it is a link in the place of a f" in error
    assert error.count("\n") == 1
    assert contents(tmp_path) == before


def test_a_link_under_the_name_of_an_unfinished_file_is_not_followed(out, tmp_path, monkeypatch):
    precious = tmp_path / "precious"
    precious.write_text("precious")
    (out / ".part-log.npz").symlink_to(precious)  # as names of unfinished files once were
    assert cli.main([*RUN, "--out", str(out)]) == 0
    assert {path.name for path in out.iterdir()} == {
        ".part-log.npz",
        "log.npz",
        "scenario.yaml",
        "metrics.json",
    }
    # Even to who guesses the name it is of no use.
    monkeypatch.setattr(output_folder.secrets, "token_hex", lambda size: "guessed")
    (out / ".guessed.part").symlink_to(precious)
    with pytest.raises(OutputError, match="File exists"):
        write_file(out / "log.npz", b"log")
    assert precious.read_text() == "precious"


def test_no_two_unfinished_files_have_one_name(out, monkeypatch):
    names = []
    real = Path.replace
    monkeypatch.setattr(Path, "replace", lambda part, to: names.append(part) or real(part, to))
    for content in ("first", "second"):
        write_file(out / "file", content)
    assert len(set(names)) == 2
    assert contents(out) == {"file": b"second"}


def test_the_folder_itself_may_be_a_link(out, tmp_path):
    link = tmp_path / "link"
    link.symlink_to(out)
    write_file(link / "below" / "file", "content")
    assert contents(out) == {"below/file": b"content"}


def test_what_is_written_can_be_read_by_those_that_the_user_lets(out):
    before = os.umask(0o027)
    try:
        write_file(out / "file", "content")
    finally:
        os.umask(before)
    assert (out / "file").stat().st_mode & 0o777 == 0o640


def test_what_cannot_be_moved_into_its_place_leaves_nothing(out, monkeypatch):
    def replace(part, to):
        raise OSError("no")

    monkeypatch.setattr(Path, "replace", replace)
    with pytest.raises(OutputError, match=r"Not written in .*: file \(no\)\. Written: nothing\."):
        write_file(out / "file", "content")
    assert contents(out) == {}


def long_name(tmp_path: Path) -> Path:
    return tmp_path / ("a" * 300) / "below"


def long_name_below(tmp_path: Path) -> Path:
    return tmp_path / "missing" / ("a" * 300)


def dangling(tmp_path: Path) -> Path:
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    return tmp_path / "link" / "below"


def looping(tmp_path: Path) -> Path:
    (tmp_path / "link").symlink_to(tmp_path / "link")
    return tmp_path / "link"


def pipe(tmp_path: Path) -> Path:
    os.mkfifo(tmp_path / "pipe")
    return tmp_path / "pipe"


def file(tmp_path: Path) -> Path:
    (tmp_path / "file").touch()
    return tmp_path / "file" / "below"


def proc(tmp_path: Path) -> Path:
    return Path("/proc/nowhere")


def proc_itself(tmp_path: Path) -> Path:
    return Path("/proc")


def sys_below(tmp_path: Path) -> Path:
    return Path("/sys/x")


def mounted(folder: Path, size: int) -> Path:
    """A small disk at a folder, which must be unmounted."""
    folder.mkdir(exist_ok=True)
    command = ["mount", "-t", "tmpfs", "-o", f"size={size}k", "tmpfs", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"a small disk needs the right to mount one: {done.stderr.strip()}")
    return folder


@pytest.fixture
def disk(tmp_path):
    """Makes disks of a size [KB]."""
    folder = tmp_path / "disk"
    yield lambda size: mounted(folder, size)
    subprocess.run(["umount", str(folder)], capture_output=True, check=False)


FOLDERS = [
    long_name,
    long_name_below,
    dangling,
    looping,
    pipe,
    file,
    proc,
    proc_itself,
    sys_below,
]
COMMANDS = [RUN, COMPARE, SWEEP, REPRODUCE, ("init",), ("bench",)]


def into(command: tuple[str, ...], folder: Path) -> list[str]:
    """The command line that writes into a folder."""
    named = {"init": [str(folder / "x.yaml")], "bench": ["--json", str(folder / "x.json")]}
    return [*command, *named.get(command[0], ["--out", str(folder)])]


def refuses(arguments: list[str], capsys) -> str:
    """What a command says that has been refused, in one line."""
    assert cli.main(arguments) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert re.fullmatch("geoimp: .*cannot be written: .*\n", said.err), said.err
    return said.err


@pytest.mark.parametrize("where", FOLDERS)
@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command[0])
def test_a_folder_that_cannot_be_written_is_refused_before_anything_is_done(
    command, where, tmp_path, capsys
):
    folder = where(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    assert str(folder) in refuses(into(command, folder), capsys)
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command[0])
def test_a_full_disk_is_refused_before_anything_is_done(command, disk, capsys):
    folder = disk(64)
    (folder / "large").write_bytes(bytes(64 * 1024))
    assert "No space left on device" in refuses(into(command, folder), capsys)
    assert sorted(folder.iterdir()) == [folder / "large"]


@pytest.mark.parametrize("make", [Path.mkdir, os.mkfifo], ids=["a folder", "a pipe"])
@pytest.mark.parametrize(
    ("command", "name"),
    [w for w in WRITTEN if "." in w[1]][::3],
    ids=lambda v: v if isinstance(v, str) else v[0],
)
def test_what_is_no_file_in_the_place_of_a_result_is_refused(command, name, make, out, capsys):
    (out / name).parent.mkdir(parents=True, exist_ok=True)
    make(out / name)
    assert f"{out / name} cannot" in refuses([*command, "--out", str(out)], capsys)


@pytest.mark.parametrize("command", ["init", "bench"])
def test_a_file_in_a_missing_folder_or_over_a_device_is_refused(command, tmp_path, capsys):
    option = ["--json"] if command == "bench" else []
    missing = tmp_path / "missing" / "file"
    assert "there is no folder" in refuses([command, *option, str(missing)], capsys)
    assert list(tmp_path.iterdir()) == []
    if command == "bench":
        os.mkfifo(tmp_path / "pipe")
        refuses(["bench", "--json", str(tmp_path / "pipe")], capsys)


def test_a_folder_without_permission_is_refused(out, capsys, monkeypatch):
    def refuse(*_, **__):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(os, "mkdir", refuse)  # root may write everywhere
    assert "Permission denied" in refuses(into(RUN, out), capsys)


def test_where_a_disk_becomes_full_what_found_room_is_kept(disk, capsys):
    folder = disk(40)  # enough for all but a figure for print
    command = ("run", "plexiglas", "--duration", "0.02", "--out", str(folder / "out"))
    assert cli.main(command) == 1
    error = capsys.readouterr().err
    assert re.fullmatch(
        r"geoimp: Not written in .*/out: figure_5_3.png.* \(No space left on device\)\. "
        r"Written: log\.npz, scenario\.yaml, metrics\.json.*\n",
        error,
    ), error
    with np.load(folder / "out" / "log.npz") as log:
        assert len(log["t"]) == 3
    json.loads((folder / "out" / "metrics.json").read_text("utf-8"))
    assert not list(folder.rglob(".*"))


def test_a_sweep_that_fills_the_disk_is_kept_and_gone_on_with(disk, capsys):
    folder = disk(40)
    arguments = [*SWEEP, "--samples", "2", "--out", str(folder)]
    assert cli.main(arguments) == 1
    error = capsys.readouterr().err
    assert re.fullmatch(
        r"geoimp: Not written in .*: .*success_map.* \(No space left on device\)\. "
        r"Written: scenario\.yaml, plan\.yaml, samples\.csv.*\n",
        error,
    ), error
    assert len((folder / "journal.jsonl").read_text().splitlines()) == 3
    subprocess.run(["mount", "-o", "remount,size=1m", str(folder)], check=True)
    there = ("--scheduler", "tcp://127.0.0.1:1")  # nothing is left to be run
    assert cli.main([*arguments, *there]) == 0
    assert (folder / "success_map.pdf").exists()


def test_what_a_reproduction_lacks_is_said_even_without_room_for_the_report(monkeypatch, out):
    def refuse(*_):
        raise OutputError("no room for the report.")

    (study,) = (s for s in reproduction.studies() if s.name == "consistency")
    study = dataclasses.replace(study, compared=())
    monkeypatch.setattr(reproduce, "write_report", refuse)
    monkeypatch.setattr(reproduce, "_compile_laws", lambda missing: None)
    monkeypatch.setattr(
        reproduce, "run_many", lambda runs, *_, **__: dict.fromkeys(runs, Finished(None, "E", 0.0))
    )
    with pytest.raises(OutputError, match=r"no room .* Runs without results: consistency/quat.*, "):
        reproduce.reproduce((study,), out)
