"""A loop has what it needs to be on time, or runs all the same and says what is missing."""

import gc
import os
import threading

import pytest

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.robots.real_time import real_time, scheduler


def refused(*_):
    raise PermissionError(1, "Operation not permitted")


def locked() -> int:
    """Returns how much memory of this process is locked [kB]."""
    with open("/proc/self/status", encoding="utf-8") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmLck"))


def test_everything_is_as_before_afterwards():
    before, memory = scheduler(), locked()
    with real_time():
        assert not gc.isenabled()
    assert gc.isenabled()
    assert scheduler() == before
    assert locked() == memory


def test_threads_that_are_made_within_are_on_time_too(caplog):
    with real_time(5) as permitted:
        if not permitted:
            pytest.skip(f"not permitted here: {caplog.text}")
        seen, memory = [], locked()
        thread = threading.Thread(target=lambda: seen.append(scheduler()))
        thread.start()
        thread.join()
    assert seen == ["SCHED_FIFO 5"]
    assert memory > 0


def test_what_is_not_permitted_is_one_warning_with_what_to_do(monkeypatch, caplog):
    before = os.sched_getscheduler(0)
    own = os.sched_setscheduler
    monkeypatch.setattr(
        os, "sched_setscheduler", lambda *a: refused() if a[1] == os.SCHED_FIFO else own(*a)
    )
    with real_time() as permitted:
        assert not permitted
        assert not gc.isenabled()
    (record,) = caplog.records
    assert "SCHED_FIFO 80 was refused (Operation not permitted)" in record.getMessage()
    assert "limits.conf" in record.getMessage()
    assert os.sched_getscheduler(0) == before


def test_a_priority_out_of_range_is_refused():
    with pytest.raises(ConfigurationError, match="priority"), real_time(99):
        pass
