"""Files of results: whole, in the folder that was named, never through a link in it."""

import os
from pathlib import Path

import pytest

from geoimp_drake import cli, output_folder
from geoimp_drake.output_folder import FileWriter

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
    assert f"{out / name} cannot be written: there is a link in the place of the f" in error
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
    with pytest.raises(FileExistsError):
        FileWriter(out).write("log.npz", b"log")
    assert precious.read_text() == "precious"


def test_no_two_unfinished_files_have_one_name(out, monkeypatch):
    names = []
    real = Path.replace
    monkeypatch.setattr(Path, "replace", lambda part, to: names.append(part) or real(part, to))
    for content in ("first", "second"):
        FileWriter(out).write("file", content)
    assert len(set(names)) == 2
    assert contents(out) == {"file": b"second"}


def test_the_folder_itself_may_be_a_link(out, tmp_path):
    link = tmp_path / "link"
    link.symlink_to(out)
    FileWriter(link / "below").write("file", "content")
    assert contents(out) == {"below/file": b"content"}


def test_what_is_written_can_be_read_by_those_that_the_user_lets(out):
    before = os.umask(0o027)
    try:
        FileWriter(out).write("file", "content")
    finally:
        os.umask(before)
    assert (out / "file").stat().st_mode & 0o777 == 0o640


def test_what_cannot_be_moved_into_its_place_leaves_nothing(out, monkeypatch):
    def replace(part, to):
        raise OSError("no")

    monkeypatch.setattr(Path, "replace", replace)
    with pytest.raises(OSError, match="no"):
        FileWriter(out).write("file", "content")
    assert contents(out) == {}
