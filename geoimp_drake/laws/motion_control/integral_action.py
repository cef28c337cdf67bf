"""Integral action of the inner motion loop: it removes the offset that model errors cause.

Textbook PID around inverse dynamics, B. Siciliano et al., "Robotics: Modelling, Planning and
Control" (2009), section 8.5; the chapter's inner loop has no integral action. Floats only.
"""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import stored
from geoimp_drake.typing import Array

__all__ = ["integral_torque", "integrated_error"]


@compilable
def integrated_error(before: Array, error: Array, elapsed: float, largest: float) -> Array:
    """Returns ∫e dt (6,) at the end of a step, within ± `largest` along each axis.

    Args:
        before: at its beginning (6,) [rad s, m s].
        error: e at its end, `pose_error` (6,) [rad, m].
        elapsed: of the step [s].
        largest: the bound against wind-up [rad s, m s].
    """
    return np.minimum(np.maximum(before + elapsed * error, -largest), largest)


@compilable
def integral_torque(B: Array, J_pinv: Array, gains: Array, error_sum: Array) -> Array:
    """(R.1) τ_I = B J† K_I ∫e dt (n,), which accelerates E by K_I ∫e dt and nothing else.

    Args:
        B: inertia matrix (n, n).
        J_pinv: J† (n, 6).
        gains: the diagonal of K_I (6,) [1/s³].
        error_sum: ∫e dt (6,).
    """
    return stored(B) @ (stored(J_pinv) @ (gains * error_sum))
