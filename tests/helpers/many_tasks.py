"""Tasks for processes of Dask's; here, so that they can be imported there."""

import os
import signal
import sys
import time
from pathlib import Path

import distributed


def square(number: int) -> int:
    return number**2


def noted(task: tuple[str, int]) -> int:
    """Leaves a line in a file, so that how often it ran can be counted."""
    folder, number = task
    with (Path(folder) / str(number)).open("a") as file:
        file.write("ran\n")
    time.sleep(0.02)
    return number**2


def deadly_once(task: tuple[str, int]) -> int:
    """Takes its process down the first time that number 3 comes."""
    folder, number = task
    mark = Path(folder) / "killed"
    if number == 3 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.02)
    return number**2


def deadly(number: int) -> int:
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number**2


def failing(number: int) -> int:
    if number == 1:
        raise ValueError("one is\nrefused")
    if number == 2:
        sys.exit("Drake gave up")
    return number**2


def surroundings(_: int) -> dict[str, object]:
    print("a message of this task alone", file=sys.stderr)
    return {
        "pid": os.getpid(),
        "threads": [os.environ.get(f"{name}_NUM_THREADS") for name in ("OMP", "OPENBLAS", "MKL")],
        "allocator": os.environ.get("GLIBC_TUNABLES"),
        "profiled": "profile" in distributed.get_worker().periodic_callbacks,
        "interruptible": signal.getsignal(signal.SIGINT) != signal.SIG_IGN,
    }
