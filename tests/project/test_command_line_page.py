"""The page of the command line is true: all that it shows runs, and writes the files it lists."""

import re
from pathlib import Path

import pytest
from documents import COMMAND_LINE, blocks, commands, execute, shortened
from library_tree import ROOT

from geoimp_drake import cli

RUNS = [arguments for arguments in commands(COMMAND_LINE, "geoimp") if arguments[0] == "run"]
LINES = [line for block in blocks(COMMAND_LINE) for line in block.text.splitlines()]
OTHERS = [line for line in LINES if not line.startswith("geoimp run ")]


def test_the_page_has_commands_of_geoimp_alone():
    assert {block.language for block in blocks(COMMAND_LINE)} == {"sh"}
    assert len(LINES) == len(commands(COMMAND_LINE, "geoimp")) == len(RUNS) + len(OTHERS) > 10


@pytest.mark.parametrize("line", OTHERS)
def test_other_commands_run(line, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "models").symlink_to(ROOT / "models")
    execute(line)


@pytest.mark.parametrize("arguments", RUNS, ids=" ".join)
def test_runs_write_the_files_that_the_page_lists(arguments, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("my.yaml").write_text("start: {tilt_deg: 7.0}\n", encoding="utf-8")
    assert cli.main(shortened(arguments)) == 0
    text = COMMAND_LINE.read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`\w+\.\w+`(?:, `\w+\.\w+`)*) \|", text, re.MULTILINE)
    listed = {name.strip("`") for row in rows for name in row.split(", ")}
    expected = listed if "--html" in arguments else listed - {"replay.html"}
    written = (tmp_path / "results" / arguments[1]).iterdir()
    # The page's N stands for the figure's number in the chapter.
    assert {re.sub(r"(?<=figure_5_)\d+", "N", path.name) for path in written} == expected
