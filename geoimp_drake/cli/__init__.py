"""The command line `geoimp`: experiments are listed, run, compared, swept, timed.

Exit status: 0 on success, 2 on unusable input (one line says what), 1 if a simulation failed.
"""

import contextlib
import logging
import sys
from collections.abc import Iterator, Sequence

from geoimp_drake.cli.commands import FAILURE, UNUSABLE
from geoimp_drake.cli.parser import make_parser
from geoimp_drake.errors import GeoimpError, ModelError, drake_errors, one_line

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit status."""
    options = make_parser().parse_args(arguments)
    try:
        with _log_on_terminal(), drake_errors(ModelError, "Drake", raised=()):
            return int(options.command(options))
    except GeoimpError as error:
        print(f"geoimp: {one_line(error)}", file=sys.stderr)
        return UNUSABLE
    except KeyboardInterrupt:
        print("geoimp: interrupted", file=sys.stderr)
        return FAILURE


@contextlib.contextmanager
def _log_on_terminal() -> Iterator[None]:
    """Shows what Drake and this library report; Python by itself shows warnings only."""
    handler, log = logging.StreamHandler(), logging.getLogger("drake")
    log.addHandler(handler)
    try:
        yield
    finally:
        log.removeHandler(handler)
