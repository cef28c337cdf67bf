"""Joint limits, torque limits and singularities kept by one quadratic program a tick."""
