"""Many independent runs on Dask: each task once, even if processes are killed meanwhile.

A task is anything that a function turns into JSON data in a process of its own. What has finished
is in a journal at once; started again with the same journal, only the missing tasks are run.
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

# One thread a process: the matrices are small, and as many processes as cores are asked for.
_THREAD_SETTINGS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMBA_NUM_THREADS",
)
# Drake's steps allocate much. glibc keeps 1000 freed blocks of a size at hand instead of 7, as
# a step in contact frees hundreds at once, and uses large pages where the kernel has them.
_ALLOCATOR = {"GLIBC_TUNABLES": "glibc.malloc.tcache_count=1000:glibc.malloc.hugetlb=1"}
# A Ctrl-C reaches every process of the terminal; the one that was started ends the others.
_IGNORE_INTERRUPTS = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"
_LOCAL = {
    # Dask keeps a task that was lost with its process apart from those that merely waited there
    # only if none waits there.
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.scheduler.allowed-failures": 3,
    # A variable that the user has set stays as it is.
    "distributed.nanny.pre-spawn-environ": dict.fromkeys(_THREAD_SETTINGS, "1") | _ALLOCATOR,
    # What Dask measures of itself, every 10 and 20 ms in each of its processes, takes the time of
    # the tasks where every core has one.
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    # Its pages about tasks and processes ask nobody who they are.
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
}
_MOST_JOBS = 1000
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

    A task that raises is finished, with its error. Where the machine is the cause, or the task
    repeatedly takes its process down, the error is not put into the journal, so that the next start
    tries the task again.

    Args:
        tasks: by key.
        function: of a module, so that another process can import it; takes a task, returns JSON
            data.
        jobs: processes on this machine, one thread each.
        journal: file for what has finished.
        plan: JSON data that says what the tasks are. A journal of another plan is refused; one
            with fewer or more tasks of the same plan is not.
        scheduler: address of a Dask scheduler whose workers are used instead of own processes.
        label: name of the command; stands before the progress bar and in errors.
        fields: types of what `function` returns, a mapping, by key; a line of the journal that does
            not fit is skipped. None for any JSON data.
        is_current: takes the key of a task in the journal and how it ended. If it returns False,
            the task is run again.

    Returns:
        How every task ended, in the order of `tasks`.

    Raises:
        ConfigurationError: fewer than one job, an extra is missing, the scheduler does not answer,
            or the journal cannot be used; nothing has been written. Or the scheduler is lost later.
        OutputError: the disk is full; what had ended before is kept.
    """
    check_jobs(jobs, label)
    book = Journal(journal, plan, fields)
    done = {key: ended for key, ended in book.read().items() if is_current(key, ended)}
    missing = {key: task for key, task in tasks.items() if key not in done}
    if missing:
        with _client(min(jobs, len(missing)), scheduler) as client, book:
            ended = _run(client, missing, function)
            for key, finished, kept in _with_progress(ended, len(tasks), len(missing), label):
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
    """Yields processes that obey nobody else.

    A scheduler or a process of Dask's runs whatever code it is sent, and every user of the machine
    reaches loopback. Here each end of a connection shows that it has the key of this cluster, which
    is made for it and handed on through pipes.
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
    """Removes what Dask adds to this process's environment for the processes that it starts."""
    before = set(os.environ)
    try:
        yield
    finally:
        for name in os.environ.keys() - before:
            del os.environ[name]


def _client_of(scheduler: Any, **options: Any) -> Any:
    """Returns a client that is not what Dask computes with by default: xarray would look for it."""
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
    """Yields each task's key as it ends, how it ended, and whether that is final."""
    from distributed import as_completed

    # Another client of the same scheduler must not be given these results for its own tasks.
    run = uuid.uuid4().hex
    futures = {
        client.submit(_attempt, function, task, key=f"{run}-{key}", pure=False): key
        for key, task in tasks.items()
    }
    for future in as_completed(futures, loop=client.loop):
        yield (futures[future], *_ending(future))


def _attempt(function: Callable[[Any], Any], task: Any) -> tuple[Finished, bool]:
    """Runs one task, in a process of Dask's; what it says on stderr is not shown.

    Returns how it ended, and whether that is final.
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
    """Whether an error began with a package, a file, room or memory that is missing here.

    It may be there another time, whatever error of this library was made of it.
    """
    while error is not None:
        if isinstance(error, OSError | ImportError | MemoryError):
            return True
        error = error.__cause__ or error.__context__
    return False


def _ending(future: Any) -> tuple[Finished, bool]:
    """Returns how a task ended; not final if the task did not even come to return."""
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
    except Exception as error:  # as a result that cannot be sent
        why = f"{type(error).__name__}: {one_line(error)}"
    return Finished(None, why, 0.0), False


def _with_progress(ended: Iterator[Any], total: int, missing: int, label: str) -> Iterator[Any]:
    """Passes on what has ended, with a progress bar on a terminal."""
    with tqdm(
        ended, label, total, initial=total - missing, unit="run", disable=not sys.stderr.isatty()
    ) as bar:
        yield from bar
