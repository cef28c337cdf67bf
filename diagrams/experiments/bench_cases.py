"""The cases of `geoimp bench`; nothing is imported for them."""

__all__ = ["BENCH_CASES"]

# By name: experiment, when, and whether its real-time factor counts as the experiment's.
BENCH_CASES = {
    "single_free": ("plexiglas", 1.0, False),
    "plexiglas": ("plexiglas", 6.0, True),
    "redundant_free": ("redundancy", 1.0, False),
    "redundancy": ("redundancy", 11.0, True),
    "bar_free": ("bar", 1.0, False),
    "bar": ("bar", 6.0, True),
    "peg_in_hole": ("peg_in_hole", 8.0, True),
}
