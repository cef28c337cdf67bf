"""The objective function w of a posture that is kept, for (3.39)."""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.typing import Array

__all__ = ["kept_posture"]


@compilable
def kept_posture(inertia: Array, start: Array, x: Array, gradients: Array) -> tuple[float, float]:
    """Returns w and ẇ; writes the gradient of w and its rate.

        w = ½ (q − q_0)ᵀ B(q_0) (q − q_0)

    All are NaN if the arm's state or q_0 is not finite. Floats only.

    Args:
        inertia: B(q_0) (n, n).
        start: q_0 (n,) [rad, m].
        x: joint positions and velocities (2n,).
        gradients: where to write ∂w/∂q and its derivative (2, n).
    """
    n = len(start)
    if not (is_finite(x) and is_finite(start)):
        gradients[:] = np.nan
        return np.nan, np.nan
    gradients[:] = 0.0
    w, w_dot = 0.0, 0.0
    for i in range(n):
        for k in range(n):
            gradients[0, i] += inertia[i, k] * (x[k] - start[k])
            gradients[1, i] += inertia[i, k] * x[n + k]
        w += 0.5 * (x[i] - start[i]) * gradients[0, i]
        w_dot += x[n + i] * gradients[0, i]
    return w, w_dot
