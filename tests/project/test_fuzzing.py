"""Whatever stands in a file or on the command line, it is done or gets one line of an error.

300 inputs by default, always the same; CONTRIBUTING.md says how to try more.
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import fuzz_cases
import pytest

CASES = int(os.environ.get("GEOIMP_FUZZ_CASES", "300"))
SEED = int(os.environ.get("GEOIMP_FUZZ_SEED", "1"))
HELPERS = Path(fuzz_cases.__file__).parent
MAIN = "import sys, pathlib; fuzz_worker.main(pathlib.Path(sys.argv[1]), *map(int, sys.argv[2:]))"


def failures(folder: Path, end: int, prelude: str = "import fuzz_worker") -> Iterator[str]:
    """Runs cases in processes of their own; yields what is wrong with a case, by its number."""
    for name in ("in", "out", "home"):
        (folder / name).mkdir()
    paths = [str(HELPERS), os.environ.get("PYTHONPATH", "")]
    home = {"HOME": str(folder / "home"), "XDG_CACHE_HOME": str(folder / "home")}
    environment = {**os.environ, **home, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    begun = -1
    while begun + 1 < end:
        arguments = [folder, SEED, begun + 1, end]
        command = [sys.executable, "-c", f"{prelude}\n{MAIN}", *map(str, arguments)]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        said = [line.split(" ", 2) for line in done.stdout.splitlines()]
        yield from (f"case {number}: {what[0]}" for word, number, *what in said if word == "fail")
        begun = max((int(number) for _, number, *_ in said), default=end)
        if not said or said[-1][0] == "begin":
            yield f"case {begun} took the process down ({done.returncode}): {done.stderr[-2000:]}"


@pytest.mark.timeout(0)  # the processes end a case that hangs
def test_no_input_ends_with_a_traceback_a_hang_or_a_crash_or_is_written_elsewhere(tmp_path):
    assert list(failures(tmp_path, CASES)) == []
    assert {path.name for path in tmp_path.iterdir()} == {"in", "out", "home"}
    made = {"mine.yaml", "plan.yaml", "mine.pdl", "journal.jsonl", "scenario.yaml", "log.npz"}
    robots = {path.name for path in fuzz_cases.ROBOTS}
    assert {path.name for path in (tmp_path / "in").iterdir()} <= made | robots


UNSOUND = """
import os, fuzz_cases, fuzz_worker
from geoimp_drake.errors import GeoimpError
def refused(): raise GeoimpError("in one line")
def endless():
    while True: pass
acts = [refused, lambda: {}["key"], os.abort, endless, lambda: fuzz_cases.command("list")[0]()]
fuzz_cases.make_case = lambda number, *_: (acts[number], "the input")
fuzz_worker.LONGEST = 1.0
"""


def test_a_traceback_a_crash_and_a_hang_are_seen(tmp_path):
    one, two, three = failures(tmp_path, 5, UNSOUND)
    assert one.startswith("case 1: ")
    assert one.endswith("KeyError: 'key' the input")
    assert two.startswith("case 2 took the process down (-6)")
    assert three.startswith("case 3 took the process down (1): Timeout")
