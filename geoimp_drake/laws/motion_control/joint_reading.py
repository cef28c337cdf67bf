"""Joint readings: sampled positions, with measured or differenced velocities."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.typing import Array

__all__ = ["next_reading"]


@compilable
def next_reading(state: Array, held: Array, period: float, differenced: bool, after: Array) -> bool:
    """Writes the reading that is held until the next sample; returns False if it is not finite.

    At the first instant the time since the held reading is unknown, so the measured velocity is
    kept: a plant with sampled output ports has then made one of its own steps, another plant none.
    Floats only.

    Args:
        state: [q; v] (2n,).
        held: the reading before and, last, how many there were: none, the first, more (2n + 1,); it
            may be `after` itself.
        period: between samples [s].
        differenced: whether v is (q − q_before)/period.
        after: where to write (2n + 1,).
    """
    if not is_finite(state):
        return False
    n = len(state) // 2
    is_difference = differenced and held[-1] > 1
    for k in range(n):
        after[n + k] = (state[k] - held[k]) / period if is_difference else state[n + k]
        after[k] = state[k]
    after[-1] = 2.0
    return True
