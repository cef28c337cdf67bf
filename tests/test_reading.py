"""Files that a user names: read if they are regular, of some size and UTF-8, otherwise one line."""

import os
import re
from pathlib import Path

import pytest
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake import cli
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.motion_program.pdl import read_program
from geoimp_drake.reading import read_text
from geoimp_drake.robot_files.loading import load_robot
from geoimp_drake.scenario.loading import read_yaml


@pytest.fixture
def pipe(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    return tmp_path / "pipe"


def test_a_text_is_read_with_a_byte_order_mark_or_without(tmp_path):
    for mark in (b"", b"\xef\xbb\xbf"):
        (tmp_path / "a").write_bytes(mark + "α\n".encode())
        assert read_text(tmp_path / "a", "note") == "α\n"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\xff\xfea\x00", "The note .*a cannot be read: .*utf-8"),
        (b"x" * 101, r"has 0.000101 MB; at most 0.0001 MB are read"),
    ],
)
def test_what_is_no_text_or_too_long_is_named(content, message, tmp_path):
    (tmp_path / "a").write_bytes(content)
    with pytest.raises(ConfigurationError, match=message):
        read_text(tmp_path / "a", "note", largest=100)


@pytest.mark.parametrize("path", ["/dev/zero", "/", "/proc/self/mem/x", "a\0b", "x" * 300])
def test_what_is_no_regular_file_is_named(path):
    with pytest.raises(ConfigurationError, match=r"^The note .* cannot be read: "):
        read_text(Path(path), "note")


@pytest.mark.parametrize(
    "read",
    [
        read_yaml,
        lambda path: read_program(path, {}),
        lambda path: load_robot(path, MultibodyPlant(1e-3), end_effector="hand"),
    ],
    ids=["scenario", "program", "robot"],
)
def test_no_reader_waits_for_a_pipe(read, pipe):
    with pytest.raises(ConfigurationError, match=r"pipe cannot be read: it is not a regular file"):
        read(pipe)


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "--scenario", "{}"),
        ("run", "plexiglas", "--scenario", "{}"),
        ("sweep", "plexiglas", "--plan", "{}"),
        ("run", "peg_in_hole", "--set", "program.file={}"),
        ("run", "plexiglas", "--set", "robot={{file: {}, end_effector: hand}}"),
    ],
)
def test_no_command_waits_for_a_pipe(arguments, pipe, tmp_path, capsys):
    given = [argument.format(pipe) for argument in arguments]
    assert cli.main([*given, "--out", str(tmp_path / "out")]) == 2
    assert re.fullmatch(r"geoimp: .*not a regular file\.\n", capsys.readouterr().err)
    assert not (tmp_path / "out").exists()
