"""How laws are compiled by numba where it is installed, and what small arrays are to it."""
