"""Runs cases of `fuzz_cases` one after another: `python fuzz_worker.py FOLDER SEED FIRST END`.

Says `begin N` and `end N`, or `fail N` with what happened, a line each, so that whoever started it
knows the case that took the process down. Nothing is simulated: a run ends where its simulation
would begin.
"""

import faulthandler
import os
import resource
import sys
import traceback
import warnings
from pathlib import Path
from typing import Any

import fuzz_cases

from geoimp_drake.campaigns import reproduce, sweep
from geoimp_drake.cli import robots
from geoimp_drake.errors import GeoimpError, one_line
from geoimp_drake.simulation import bench, experiment

LONGEST = 60.0  # that a case may take before it counts as hanging [s]
MOST_SAID = 5000  # characters of an error
MOST_MEMORY = 8 << 30  # address space [bytes]; Drake and LLVM alone take two


class NotDoneError(GeoimpError):
    """Stands in the place of what would take time."""


def _stop(*_: object, **__: object) -> None:
    raise NotDoneError("not done here")


def _built(build: Any, scenario: Any) -> tuple[list[str], list[str]]:
    """Stands in the place of what also starts a set-up: numba would compile the laws."""
    build(scenario)
    return [], []


def run(number: int, seed: int, folder: Path) -> None:
    """Runs one case; raises what is no error of the library, or is one over several lines."""
    act, description = fuzz_cases.make_case(number, seed, folder)
    said = ""
    try:
        act()
    except GeoimpError as error:
        said = str(error)
    except BaseException as error:
        error.add_note(description)
        raise
    assert len(said) < MOST_SAID, f"{description}: {len(said)} characters"


def main(folder: Path, seed: int, first: int, end: int) -> None:
    """Runs cases and says how they end."""
    for module, name in ((experiment, "simulate"), (sweep, "run_many"), (reproduce, "run_many")):
        setattr(module, name, _stop)
    bench.run_bench = _stop
    robots.said_of = _built
    warnings.simplefilter("error")
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    os.chdir(folder / "out")
    say = os.fdopen(os.dup(1), "w", buffering=1, encoding="utf-8")
    for number in range(first, end):
        say.write(f"begin {number}\n")
        faulthandler.dump_traceback_later(LONGEST, exit=True)
        try:
            run(number, seed, folder)
        except BaseException:
            say.write(f"fail {number} {one_line(traceback.format_exc())}\n")
        else:
            say.write(f"end {number}\n")
    faulthandler.cancel_dump_traceback_later()
    say.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]), *map(int, sys.argv[2:]))
