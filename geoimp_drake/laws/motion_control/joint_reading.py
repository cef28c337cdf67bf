"""Joint readings: sampled positions, with measured or differenced velocities."""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.typing import Array

__all__ = ["next_reading"]

_TURN = 2.0 * np.pi


@compilable
def next_reading(
    differenced: bool, turns: Array, state: Array, held: Array, after: Array, period: float
) -> bool:
    """Writes the reading that is held until the next sample; returns False if it is not finite.

    A revolute joint must move by less than half a turn between two samples. Where its reading jumps
    by whole turns, as a resolver's does at ±π, these are removed.

    At the first instant the time since the held reading is unknown, so the measured velocity is
    kept. A plant with sampled output ports has then made one of its own steps, another plant none.
    Floats only.

    Args:
        differenced: whether v is (q − q_before)/period.
        turns: 1 for each revolute joint, 0 for a prismatic one (n,).
        state: [q; v] (2n,).
        held: the previous reading and, last, the number of readings so far: 0, 1, or 2 for more
            (2n + 1,). It may be `after` itself.
        after: where to write (2n + 1,).
        period: between samples [s].
    """
    if not is_finite(state):
        return False
    n = len(state) // 2
    is_difference, follows = differenced and held[-1] > 1, held[-1] > 0
    for k in range(n):
        q = state[k]
        if follows:
            q -= turns[k] * _TURN * np.rint((q - held[k]) / _TURN)
        after[n + k] = (q - held[k]) / period if is_difference else state[n + k]
        after[k] = q
    after[-1] = 2.0
    return True
