"""The operating system's services that a loop needs to be on time."""

import ctypes
import gc
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager

from geoimp_drake.validation import whole_number

__all__ = ["real_time", "scheduler"]

_log = logging.getLogger("drake")

# Flags of mlockall: the present memory, and all that is allocated later.
_MCL_CURRENT, _MCL_FUTURE = 1, 2


@contextmanager
def real_time(priority: int = 80) -> Iterator[bool]:
    """Gives this process the services that a loop needs to be on time, until the context ends.

    The scheduler is SCHED_FIFO, memory is locked, and Python's garbage collector is off. Threads
    inherit the scheduler when they start: enter the context **before** the driver connects, since
    LCM starts its receiving thread then. A receiver that has to wait makes 16 % of the ticks late
    instead of 1 %.

    If the system does not permit one of these, the loop still runs. One warning says what is
    missing and what to do.

    Args:
        priority: of SCHED_FIFO, 1 to 98; one above that of interrupts is asking for trouble.

    Yields:
        Whether all of it was permitted.

    Raises:
        ConfigurationError: the priority is out of range.
    """
    whole_number(priority, "priority", 1, 98)
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    collects = gc.isenabled()
    missing = [*_set_fifo(priority), *_lock_memory()]
    if missing:
        _log.warning("Not in real time: %s.", "; ".join(missing))
    gc.collect()
    gc.disable()
    try:
        yield not missing
    finally:
        if collects:
            gc.enable()
        ctypes.CDLL(None).munlockall()
        os.sched_setscheduler(0, *before)


def scheduler() -> str:
    """Returns the name of this thread's scheduler, with its priority if it has one."""
    policy, priority = os.sched_getscheduler(0), os.sched_getparam(0).sched_priority
    names = {os.SCHED_FIFO: "SCHED_FIFO", os.SCHED_RR: "SCHED_RR", os.SCHED_OTHER: "SCHED_OTHER"}
    name = names.get(policy, f"scheduler {policy}")
    return f"{name} {priority}" if priority else name


def _set_fifo(priority: int) -> list[str]:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError as error:
        return [
            f"SCHED_FIFO {priority} was refused ({error.strerror}), the limit rtprio in "
            f"/etc/security/limits.conf permits it"
        ]
    return []


def _lock_memory() -> list[str]:
    library = ctypes.CDLL(None, use_errno=True)
    if library.mlockall(_MCL_CURRENT | _MCL_FUTURE) == 0:
        return []
    reason = os.strerror(ctypes.get_errno())
    return [f"memory was not locked ({reason}), the limit memlock (unlimited) permits it"]
