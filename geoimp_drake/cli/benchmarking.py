"""The command `geoimp benchmark`; nothing is imported before it is needed."""

import argparse
import os
from pathlib import Path
from typing import Any

from geoimp_drake.cli.commands import print_report, status_of
from geoimp_drake.cli.options import add_scheduler

__all__ = ["add_benchmark"]


def add_benchmark(subparsers: Any) -> None:
    """Adds the command."""
    parser = subparsers.add_parser(
        "benchmark",
        help="run this library beside others on the same work and write one report",
        description="Runs what is compared, each section in its folder, and writes report.html. "
        "Started again with the same folder it does only what is missing or would come out "
        "differently.",
        epilog="Exit status: as of `geoimp reproduce`.",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder to write (results/benchmark)"
    )
    parser.add_argument("--jobs", type=int, metavar="N", help="processes (one a core)")
    parser.add_argument(
        "--only",
        nargs="+",
        metavar="SECTION",
        help="run these sections (all; a wrong name lists them)",
    )
    parser.add_argument(
        "--quick", action="store_true", help="fewer errors and cases, a tenth of the samples"
    )
    add_scheduler(parser)
    parser.set_defaults(command=_benchmark)


def _benchmark(options: argparse.Namespace) -> int:
    """Runs the sections that are asked for. Returns the exit status."""
    from geoimp_drake.campaigns.reproduce import reproduce
    from geoimp_drake.campaigns.study import Study
    from geoimp_drake.diagrams.experiments import benchmarks
    from geoimp_drake.validation import choice

    parts = benchmarks.parts(quick=options.quick, scheduler=options.scheduler)
    for name in options.only or ():
        choice(name, "section", parts)
    chosen = [part for name, part in parts.items() if name in (options.only or parts)]
    out = options.out or Path("results") / "benchmark"
    reproduction = reproduce(
        [part for part in chosen if isinstance(part, Study)],
        out,
        jobs=(os.cpu_count() or 1) if options.jobs is None else options.jobs,
        sections=[part for part in chosen if not isinstance(part, Study)],
        page=benchmarks.page(),
    )
    print_report(reproduction, out)
    return status_of(reproduction.failures())
