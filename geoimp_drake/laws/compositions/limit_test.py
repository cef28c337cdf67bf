"""Whether the limits leave a joint acceleration as it is."""

import numpy as np

from geoimp_drake.laws.limits.acceleration_box import limits_bind
from geoimp_drake.laws.motion_control.inverse_dynamics import inverse_dynamics
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import singular_value_or_bound
from geoimp_drake.typing import Array

__all__ = ["limit_test"]


def limit_test(
    J: Array,
    B: Array,
    Cv: Array,
    Fv: Array,
    g: Array,
    h: Array,
    x: Array,
    alpha: Array,
    limits: Array,
    settings: Array,
) -> bool:
    """Whether an acceleration, its torques (2.3) or the posture is beyond a limit. Floats only.

    Args:
        J: this and the following five are those of `inverse_dynamics`.
        B: see there.
        Cv: see there.
        Fv: see there.
        g: see there.
        h: see there.
        x: joint positions and velocities (2n,) [rad, m; rad/s, m/s].
        alpha: joint accelerations (n,) [rad/s², m/s²].
        limits: see `acceleration_box` (5, n).
        settings: see `constrained_acceleration`.
    """
    if singular_value_or_bound(J, settings[2]) < settings[2]:
        return True
    tau = inverse_dynamics(B, alpha, Cv, Fv, g, J, h)
    return limits_bind(x, B, alpha, tau, np.arange(len(tau)), limits, settings)
