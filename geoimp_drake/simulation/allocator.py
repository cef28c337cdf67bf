"""Drake's steps allocate much: a program may ask glibc to manage its memory for that."""

import os
import sys
from collections.abc import Mapping

__all__ = ["restart_with_settings"]

_VARIABLE = "GLIBC_TUNABLES"

# How many freed blocks of a size a thread keeps at hand; glibc keeps 7 by itself, and a step in
# contact frees hundreds at once. Large pages where the kernel has them: what a step touches lies
# scattered over many small ones.
_SETTINGS = "glibc.malloc.tcache_count=1000:glibc.malloc.hugetlb=1"


def restart_with_settings() -> None:
    """Starts this program anew, in the same process, with glibc's allocator set for simulations.

    glibc reads its settings only when a program starts. Nothing is done with another C library, or
    if the environment variable GLIBC_TUNABLES or LD_PRELOAD is set: somebody has chosen.
    """
    if _is_glibc() and not {_VARIABLE, "LD_PRELOAD"} & os.environ.keys():
        _restart({**os.environ, _VARIABLE: _SETTINGS})


def _restart(environment: Mapping[str, str]) -> None:
    sys.stdout.flush()
    sys.stderr.flush()
    os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], environment)


def _is_glibc() -> bool:
    try:
        return str(os.confstr("CS_GNU_LIBC_VERSION")).startswith("glibc")
    except (AttributeError, ValueError, OSError):
        return False
