"""The objective function w of joints that follow a trajectory of their own, for (3.39)."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.smooth_rest import smooth_step
from geoimp_drake.typing import Array

__all__ = ["joint_target"]


@compilable
def joint_target(
    q: Array,
    v: Array,
    start: Array,
    index: Array,
    target: Array,
    time: float,
    duration: float,
    gradient: Array,
    gradient_rate: Array,
) -> tuple[float, float]:
    """Returns w and ẇ; writes the gradient of w and its rate, zero for joints that are not chosen.

        w = ½ Σ e_i²,   e_i = q_i − q_di(t),   q_d = q_start + s (q_target − q_start)

    with s of `smooth_step`. Floats only.

    Args:
        q: joint positions (n,) [rad, m].
        v: joint velocities (n,).
        start: where the trajectory begins (n,).
        index: of the chosen joints (k,).
        target: where it ends, for the chosen joints (k,).
        time: since it begins [s].
        duration: of the trajectory [s].
        gradient: where to write ∂w/∂q (n,).
        gradient_rate: where to write its derivative (n,).
    """
    s, s_dot, _ = smooth_step(time, duration)
    gradient[:] = 0.0
    gradient_rate[:] = 0.0
    w, w_dot = 0.0, 0.0
    for k in range(len(index)):
        i = index[k]
        path = target[k] - start[i]
        e, e_dot = q[i] - start[i] - s * path, v[i] - s_dot * path
        gradient[i], gradient_rate[i] = e, e_dot
        w += 0.5 * e * e
        w_dot += e * e_dot
    return w, w_dot
