"""Compilation of laws by numba, where it is installed, and small arrays for it."""
