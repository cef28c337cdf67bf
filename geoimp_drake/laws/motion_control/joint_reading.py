"""Joint readings as a laboratory takes them: velocities by differencing sampled positions."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.typing import Array

__all__ = ["next_reading"]


@compilable
def next_reading(state: Array, held: Array, period: float, differenced: bool, after: Array) -> bool:
    """Writes what is held until the next sample; says whether it could. Floats only.

    At the first instant nothing is known about the time between the held reading and this one, and
    the measured velocity stays: a plant with sampled output ports has made one of its own steps by
    then, another none.

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
