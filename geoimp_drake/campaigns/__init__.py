"""Many runs: comparisons, sweeps, the reproduction of the whole chapter, and their reports."""
