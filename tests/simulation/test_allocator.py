"""A program starts itself anew, once and with the same arguments, unless somebody has chosen."""

import os
import subprocess
import sys

import pytest

from geoimp_drake import cli
from geoimp_drake.simulation import allocator
from geoimp_drake.simulation.allocator import restart_with_settings

SHOWN = "glibc.malloc.tcache_count=1000:glibc.malloc.hugetlb=1"
PROGRAM = (
    "import os, sys\n"
    "from geoimp_drake.simulation.allocator import restart_with_settings\n"
    "restart_with_settings()\n"
    "print(os.environ.get('GLIBC_TUNABLES'), *sys.argv[1:])\n"
)

needs_glibc = pytest.mark.skipif(not allocator._is_glibc(), reason="the C library is not glibc")


def said_by_a_program(**environment: str) -> str:
    own = {k: v for k, v in os.environ.items() if k not in {"GLIBC_TUNABLES", "LD_PRELOAD"}}
    result = subprocess.run(
        [sys.executable, "-c", PROGRAM, "--a", "b c"],
        env={**own, **environment},
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    return result.stdout.strip()


@needs_glibc
def test_program_starts_anew_with_its_arguments() -> None:
    assert said_by_a_program() == f"{SHOWN} --a b c"


def test_what_somebody_has_chosen_stays() -> None:
    chosen = "glibc.malloc.tcache_count=20"
    assert said_by_a_program(GLIBC_TUNABLES=chosen) == f"{chosen} --a b c"
    assert said_by_a_program(LD_PRELOAD="") == "None --a b c"


def test_another_c_library_is_left_alone(monkeypatch) -> None:
    def unknown(name: str) -> str:
        raise ValueError(name)

    monkeypatch.delenv("GLIBC_TUNABLES", raising=False)
    monkeypatch.delenv("LD_PRELOAD", raising=False)
    monkeypatch.setattr(os, "confstr", unknown)
    monkeypatch.setattr(os, "execve", lambda *_: pytest.fail("started anew"))
    restart_with_settings()


@pytest.mark.parametrize(("command", "anew"), [("run", 1), ("bench", 1), ("list", 0)])
def test_what_simulates_is_started_anew(monkeypatch, command: str, anew: int) -> None:
    started = []
    monkeypatch.setattr(cli, "restart_with_settings", lambda: started.append(command))
    monkeypatch.setattr(cli, "main", lambda: 0)
    monkeypatch.setattr(sys, "argv", ["geoimp", command])
    assert cli.program() == 0
    assert len(started) == anew
