"""The command line `geoimp`: lists, runs, compares, sweeps and times experiments.

Exit status: 0 on success; 2 on unusable input (one line says what). It is 1 if a package is
missing, a simulation failed, or its results could not be written. It is also 1 if a drive ended
before its motion, or the program was told to end.
"""

import contextlib
import logging
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from typing import NoReturn

from geoimp_drake.cli.caches import keep_caches
from geoimp_drake.cli.commands import FAILURE, UNUSABLE
from geoimp_drake.cli.parser import make_parser
from geoimp_drake.errors import (
    GeoimpError,
    MissingPackageError,
    ModelError,
    OutputError,
    drake_errors,
    one_line,
)

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit status."""
    options = make_parser().parse_args(arguments)
    try:
        with _log_on_terminal(), _signals_interrupt(), drake_errors(ModelError, "Drake", raised=()):
            keep_caches()
            return int(options.command(options))
    except GeoimpError as error:
        print(f"geoimp: {one_line(error)}", file=sys.stderr)
        return FAILURE if isinstance(error, OutputError | MissingPackageError) else UNUSABLE
    except KeyboardInterrupt as interrupt:
        by = "".join(f" by {name}" for name in interrupt.args)
        print(f"geoimp: interrupted{by}", file=sys.stderr)
        return FAILURE


@contextlib.contextmanager
def _signals_interrupt() -> Iterator[None]:
    """Ends the program as Ctrl-C does, if it is told to end or its terminal is closed.

    Python by itself would leave temporary folders and processes behind. Signals that the parent
    process ignores (nohup) stay ignored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    ours = [s for s in (signal.SIGTERM, signal.SIGHUP) if signal.getsignal(s) == signal.SIG_DFL]
    for number in ours:
        signal.signal(number, _interrupt)
    try:
        yield
    finally:
        for number in ours:
            signal.signal(number, signal.SIG_DFL)


def _interrupt(number: int, _: object) -> NoReturn:
    signal.signal(number, signal.SIG_IGN)  # a second signal would disturb the clearing up
    raise KeyboardInterrupt(signal.Signals(number).name)


def _is_shown(record: logging.LogRecord) -> bool:
    """Returns whether a record is Drake's or this library's, or another's warning."""
    return record.name.partition(".")[0] == "drake" or record.levelno >= logging.WARNING


@contextlib.contextmanager
def _log_on_terminal() -> Iterator[None]:
    """Shows the log of Drake and of this library; Python by itself shows only warnings.

    The handler is at the root. If the root had none, Drake would add one with its first message of
    C++, and both would show everything afterwards.
    """
    handler, log = logging.StreamHandler(), logging.getLogger()
    handler.addFilter(_is_shown)
    log.addHandler(handler)
    try:
        yield
    finally:
        log.removeHandler(handler)
