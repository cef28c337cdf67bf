"""How many pieces of memory compiled laws have taken."""

from geoimp_drake.compilation.compiled import is_available

__all__ = ["allocations_of_laws"]


def allocations_of_laws() -> int:
    """Returns how many there were since the first call, those for arrays from Python included."""
    assert is_available()
    from numba.core.runtime import _nrt_python, rtsys

    _nrt_python.memsys_enable_stats()
    stats = rtsys.get_allocation_stats()
    return int(stats.alloc + stats.mi_alloc)
