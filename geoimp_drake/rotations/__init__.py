"""Rotations as plain arrays: no Drake import, no state.

Every function accepts arrays of `float` and of Drake's `AutoDiffXd` unless its docstring says
otherwise. Quaternions are [η, ε] = [w, x, y, z].
"""
