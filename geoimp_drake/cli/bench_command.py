"""The command `geoimp bench`; nothing is imported before it is needed."""

import argparse

from geoimp_drake.cli.commands import SUCCESS
from geoimp_drake.diagrams.experiments.bench_cases import BENCH_CASES
from geoimp_drake.errors import ConfigurationError

__all__ = ["bench"]


def bench(options: argparse.Namespace) -> int:
    """Times the closed loop against the bare plant, a tick, or LCM. Returns the exit status."""
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment
    from geoimp_drake.diagrams.setups.bench_real_time import run_real_time_bench
    from geoimp_drake.diagrams.setups.bench_tick import run_tick_bench
    from geoimp_drake.output_folder import check_file, write_file
    from geoimp_drake.simulation.bench import BenchCase, run_bench
    from geoimp_drake.validation import choice

    other = run_tick_bench if options.tick else run_real_time_bench if options.realtime else None
    if other is not None and (options.only or options.compare):
        raise ConfigurationError(
            "--tick and --realtime have no cases; leave out --only and --compare."
        )
    for name in options.only or ():
        choice(name, "case", BENCH_CASES)
    cases = [
        BenchCase(name, get_experiment(experiment), start, real_time)
        for name, (experiment, start, real_time) in BENCH_CASES.items()
        if name in (options.only or BENCH_CASES)
    ]
    if options.json is not None:
        check_file(options.json)
    table, timings = run_bench(cases, options.compare) if other is None else other()
    print(table)
    if options.json is not None:
        write_file(options.json, timings)
    return SUCCESS
