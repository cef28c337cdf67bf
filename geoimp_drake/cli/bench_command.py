"""What `geoimp bench` does; nothing is imported before it is needed."""

import argparse

from geoimp_drake.cli.commands import SUCCESS
from geoimp_drake.errors import ConfigurationError

__all__ = ["BENCH_CASES", "bench"]

# What is timed: experiment, when, and whether its real-time factor counts as the experiment's.
BENCH_CASES = {
    "single_free": ("plexiglas", 1.0, False),
    "plexiglas": ("plexiglas", 6.0, True),
    "redundant_free": ("redundancy", 1.0, False),
    "redundancy": ("redundancy", 11.0, True),
    "bar_free": ("bar", 1.0, False),
    "bar": ("bar", 6.0, True),
    "peg_in_hole": ("peg_in_hole", 8.0, True),
}


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
