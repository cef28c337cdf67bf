"""Tasks for processes of Dask's; here, so that they can be imported there."""

import os
import signal
import sys
import time
from pathlib import Path

import distributed

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.output_folder import write_file


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


def where(number: int) -> list[int]:
    return [number**2, os.getpid()]


def lacking(task: tuple[str, str]) -> str:
    """Lacks something of the machine, until there is a file `installed`; an input never works."""
    folder, kind = task
    if (Path(folder) / "installed").exists() and kind != "input":
        return kind
    try:
        if kind == "extra":
            import no_such_package  # noqa: F401
        if kind == "file":
            Path(folder, "missing").read_text()
        if kind == "memory":
            raise MemoryError
    except ImportError:
        raise ConfigurationError("pip install 'geoimp_drake[extra]'") from None
    except OSError as error:
        raise ConfigurationError("cannot be read") from error
    if kind == "disk":
        write_file(Path("/proc/nowhere"), "")
    raise ConfigurationError("cannot be used")
