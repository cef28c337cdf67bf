"""Many independent runs on Dask: each task once, even if processes are killed meanwhile.

A task is anything that a function turns into JSON data in a process of its own. A journal takes
each finished task at once. Started again with the same journal, only the missing tasks run.
"""

import asyncio
import concurrent.futures
import contextlib
import io
import os
import sys
import tempfile
import time
import uuid
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from tqdm import tqdm

from geoimp_drake.campaigns.journal import Fields, Finished, Journal
from geoimp_drake.errors import ConfigurationError, OutputError, one_line
from geoimp_drake.extras import needs_extra
from geoimp_drake.validation import whole_number

__all__ = ["check_jobs", "run_many"]

# One thread a process: the matrices are small, and there are as many processes as cores.
_THREAD_SETTINGS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMBA_NUM_THREADS",
)
# Drake's steps allocate much, and a step in contact frees hundreds of blocks at once. So glibc
# keeps 1000 freed blocks of a size at hand instead of 7. It uses large pages where the kernel has
# them.
_ALLOCATOR = {"GLIBC_TUNABLES": "glibc.malloc.tcache_count=1000:glibc.malloc.hugetlb=1"}
# A Ctrl-C reaches every process of the terminal; only the first one reacts, and ends the others.
_IGNORE_INTERRUPTS = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"
_LOCAL = {
    # A task that was lost with its process must not be confused with tasks that merely waited
    # there. For Dask to tell them apart, no task may wait there.
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.scheduler.allowed-failures": 3,
    # A variable that the user has set stays as it is.
    "distributed.nanny.pre-spawn-environ": dict.fromkeys(_THREAD_SETTINGS, "1") | _ALLOCATOR,
    # Every 10 and 20 ms Dask measures itself in each of its processes. If every core has a task,
    # that takes time from the tasks.
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    # Its pages about tasks and processes have no access control.
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
}
_MOST_JOBS = 1000
# Tasks of an own process; then others take over. Drake 1.51 keeps each system that is written in
# Python until the process ends, and with it the diagram: 3 to 4 MB a run. Drake 1.58 does not.
_SHARE = 100
_CONNECT_TIMEOUT, _WORKER_TIMEOUT = 5.0, 30.0  # [s]


def run_many(
    tasks: Mapping[str, Any],
    function: Callable[[Any], Any],
    *,
    jobs: int,
    journal: Path,
    plan: Mapping[str, Any],
    scheduler: str | None = None,
    label: str = "geoimp",
    fields: Fields | None = None,
    is_current: Callable[[str, Finished], bool] = lambda key, finished: True,
) -> dict[str, Finished]:
    """Runs a function on every task that is not in the journal yet.

    A task that raises is finished, with its error. If the machine is the cause, or the task
    repeatedly takes its process down, the journal does not get the error. The next start then tries
    the task again.

    Args:
        tasks: by key.
        function: of a module, so that another process can import it; takes a task, returns JSON
            data.
        jobs: processes on this machine, one thread each.
        journal: file for the finished tasks.
        plan: JSON data that describe the tasks. A journal of another plan is refused; one with
            fewer or more tasks of the same plan is not.
        scheduler: address of a Dask scheduler whose workers are used instead of own processes.
        label: name of the command, for the progress bar and errors.
        fields: types of the results of `function` by key; a line of the journal that does not fit
            is skipped. None for any JSON data.
        is_current: takes the key of a task in the journal and its result. If it returns False, the
            task runs again.

    Returns:
        The result of every task, in the order of `tasks`.

    Raises:
        ConfigurationError: there is less than one job, an extra is missing, the scheduler does not
            answer, or the journal cannot be used. Nothing has been written then. Or the scheduler
            is lost later.
        OutputError: the disk is full; tasks that had ended before are kept.
    """
    check_jobs(jobs, label)
    book = Journal(journal, plan, fields)
    done = {key: ended for key, ended in book.read().items() if is_current(key, ended)}
    missing = {key: task for key, task in tasks.items() if key not in done}
    share = len(missing) if scheduler is not None else jobs * _SHARE
    while missing:
        part = {key: missing.pop(key) for key in list(missing)[:share]}
        with _client(min(jobs, len(part)), scheduler) as client, book:
            ended = _run(client, part, function)
            progress = _with_progress(ended, len(tasks), len(done), label, is_last=not missing)
            for key, finished, kept in progress:
                if kept:
                    _keep(book, key, finished, f"{len(done)} of {len(tasks)}")
                done[key] = finished
    return {key: done[key] for key in tasks}


def _keep(book: Journal, key: str, finished: Finished, before: str) -> None:
    """Puts a finished task into the journal; the error says how many were kept before."""
    try:
        book.add(key, finished)
    except OutputError as error:
        raise OutputError(
            f"{error} {before} runs are kept; start the same again for the others."
        ) from error


def check_jobs(jobs: int, label: str) -> None:
    """Raises ConfigurationError for fewer jobs than one or too many, or if an extra is missing."""
    whole_number(jobs, "jobs", 1, _MOST_JOBS)
    with needs_extra("sweep", label):
        import cryptography  # noqa: F401  (an extra: imported only where it is used)
        import distributed  # noqa: F401


@contextlib.contextmanager
def _client(jobs: int, scheduler: str | None) -> Iterator[Any]:
    """Yields a client of the scheduler, or of processes of its own."""
    if scheduler is None:
        with _local_cluster(jobs) as cluster, _client_of(cluster) as client:
            yield client
    else:
        with _connected(scheduler) as client:
            yield client


@contextlib.contextmanager
def _local_cluster(jobs: int) -> Iterator[Any]:
    """Yields processes that accept orders from nobody else.

    A scheduler or a process of Dask's runs any code that it is sent, and every user of the machine
    reaches loopback. Here each end of a connection proves that it has the key of this cluster. The
    key is made for this cluster and passed on through pipes.
    """
    import dask
    from distributed import LocalCluster, Security

    with (
        tempfile.TemporaryDirectory(prefix="geoimp-") as folder,
        dask.config.set({**_LOCAL, "temporary-directory": folder}),
        _same_variables(),
        LocalCluster(
            n_workers=jobs,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            security=Security.temporary(),
            dashboard_address="127.0.0.1:0",  # any free port
            scheduler_kwargs={"dashboard": False},
            memory_limit=0,
            silence_logs="CRITICAL",
            preload=_IGNORE_INTERRUPTS,
        ) as cluster,
    ):
        yield cluster


@contextlib.contextmanager
def _same_variables() -> Iterator[None]:
    """Removes the variables that Dask adds to this process's environment for its processes."""
    before = set(os.environ)
    try:
        yield
    finally:
        for name in os.environ.keys() - before:
            del os.environ[name]


def _client_of(scheduler: Any, **options: Any) -> Any:
    """Returns a client that is not Dask's default one, which xarray would use."""
    from distributed import Client

    return Client(scheduler, set_as_default=False, **options)


def _connected(address: str) -> Any:
    """Returns a client of a scheduler that answers and has workers."""
    try:
        client = _client_of(address, timeout=_CONNECT_TIMEOUT)
    except (OSError, ValueError, TypeError) as error:
        raise ConfigurationError(
            f"The scheduler {address} does not answer within {_CONNECT_TIMEOUT:g} s: "
            f"{one_line(error)}"
        ) from None
    try:
        client.wait_for_workers(1, timeout=_WORKER_TIMEOUT)
    except TimeoutError:
        client.close()
        raise ConfigurationError(
            f"The scheduler {address} has no workers; start some: dask worker {address} "
            f"--nthreads 1"
        ) from None
    return client


def _run(
    client: Any, tasks: Mapping[str, Any], function: Callable[[Any], Any]
) -> Iterator[tuple[str, Finished, bool]]:
    """Yields each task's key when it ends, its result, and whether that is final."""
    from distributed import as_completed

    # Another client of the same scheduler must not get these results for its own tasks.
    run = uuid.uuid4().hex
    futures = {
        client.submit(_attempt, function, task, key=f"{run}-{key}", pure=False): key
        for key, task in tasks.items()
    }
    for future in as_completed(futures, loop=client.loop):
        # Without its future, Dask forgets the result, and cannot lose it with a process.
        yield (futures.pop(future), *_ending(future))


def _attempt(function: Callable[[Any], Any], task: Any) -> tuple[Finished, bool]:
    """Runs one task, in a process of Dask's; its output on stderr is not shown.

    Returns its result, and whether that is final.
    """
    start = time.perf_counter()
    result, error, final = None, None, True
    try:
        # A progress bar or message of this task's own would break the one of all tasks.
        with contextlib.redirect_stderr(io.StringIO()):
            result = function(task)
    except (Exception, SystemExit) as raised:  # Drake ends the process on some input
        error = f"{type(raised).__name__}: {one_line(raised)}"
        final = not _is_of_the_machine(raised)
    return Finished(result, error, time.perf_counter() - start), final


def _is_of_the_machine(error: BaseException | None) -> bool:
    """Returns whether an error began with a missing package or file, or a lack of room or memory.

    Such a cause may pass, whatever error of this library followed from it.
    """
    while error is not None:
        if isinstance(error, OSError | ImportError | MemoryError):
            return True
        error = error.__cause__ or error.__context__
    return False


def _ending(future: Any) -> tuple[Finished, bool]:
    """Returns a task's result; it is not final if the task never came to return."""
    from distributed import KilledWorker

    try:
        finished, final = future.result()
        return finished, final
    except KilledWorker as error:
        why = f"The process that ran it was lost, {error.allowed_failures + 1} times."
    except (concurrent.futures.CancelledError, asyncio.CancelledError):
        raise ConfigurationError(
            "The scheduler was lost. What has finished is kept: start the same again."
        ) from None
    except Exception as error:  # for instance a result that cannot be sent
        why = f"{type(error).__name__}: {one_line(error)}"
    return Finished(None, why, 0.0), False


def _with_progress(
    ended: Iterator[Any], total: int, done: int, label: str, *, is_last: bool
) -> Iterator[Any]:
    """Passes finished tasks on, with a progress bar on a terminal, which only the last leaves."""
    hidden = not sys.stderr.isatty()
    with tqdm(ended, label, total, initial=done, unit="run", disable=hidden, leave=is_last) as bar:
        yield from bar
