"""Tests of two processes that speak in real time, on a machine that also does other work."""

import contextlib
import os
from collections.abc import Iterator

import pytest

# A machine may stand still for a second, and then the robot or its controller rightly stops.
another_try = pytest.mark.flaky(reruns=2)


@contextlib.contextmanager
def precedence() -> Iterator[None]:
    """Lets this process, and those that it starts, go before others, if that is permitted."""
    before = os.getpriority(os.PRIO_PROCESS, 0)
    with contextlib.suppress(PermissionError):
        os.setpriority(os.PRIO_PROCESS, 0, before - 10)
    try:
        yield
    finally:
        with contextlib.suppress(PermissionError):
            os.setpriority(os.PRIO_PROCESS, 0, before)
