"""How many pieces of memory compiled laws have taken."""

from collections.abc import Callable
from typing import Any

from geoimp_drake.compilation.compiled import is_available

__all__ = ["allocations_of_laws", "allocations_of_ticks"]


def allocations_of_laws() -> int:
    """Returns how many there were since the first call, those for arrays from Python included."""
    assert is_available()
    from numba.core.runtime import _nrt_python, rtsys

    _nrt_python.memsys_enable_stats()
    stats = rtsys.get_allocation_stats()
    return int(stats.alloc + stats.mi_alloc)


def allocations_of_ticks(step: Callable[[int], Any], ticks: int = 1000) -> int:
    """Returns how many there were in ticks after the first one; `step` is given their numbers."""
    step(1)
    before = allocations_of_laws()
    for k in range(2, ticks + 2):
        step(k)
    return allocations_of_laws() - before
