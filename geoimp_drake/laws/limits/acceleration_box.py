"""The joint accelerations that keep an arm within its positions and velocities."""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.typing import Array

__all__ = ["acceleration_box", "limits_bind"]


@compilable
def _viable_speed(distance: float, deceleration: float, horizon: float) -> float:
    """Returns the largest speed toward a stop from which a joint can brake; negative behind it.

    (L.2) v ≤ min(√(2 v̇ |d|), |d|/T): close to the stop the root would be steep.
    """
    speed = abs(distance) / horizon
    if np.isfinite(deceleration):
        speed = min(speed, np.sqrt(2.0 * deceleration * abs(distance)))
    return speed if distance >= 0.0 else -speed


@compilable
def _bounds(
    q: float, v: float, inertia: float, limits: Array, settings: Array
) -> tuple[float, float]:
    """Returns the bounds of (L.1) for a joint; `limits` are its own (5,)."""
    T, share = settings[0], settings[1]
    slowing = share * limits[4] / inertia
    # The velocity follows its bound with the time constant T, so the bound is that of T ahead.
    low = -_viable_speed(q + T * min(v, 0.0) - limits[0], slowing, T)
    high = _viable_speed(limits[1] - q - T * max(v, 0.0), slowing, T)
    lower = (min(max(low, limits[2]), limits[3]) - v) / T
    return lower, (max(min(high, limits[3]), limits[2]) - v) / T


@compilable
def acceleration_box(
    q: Array, v: Array, B: Array, limits: Array, settings: Array, box: Array
) -> None:
    """Writes the box of (L.1): α within (v̲ − v)/T and (v̄ − v)/T. Floats only.

    v̲ and v̄ are the velocity limits, or the viable speed before a stop (L.2) if that is smaller. A
    joint brakes with a share of the deceleration τ̄/B_jj that its effort limit gives.

    Args:
        q: joint positions (n,) [rad, m].
        v: joint velocities (n,) [rad/s, m/s].
        B: joint inertia (n, n).
        limits: lower and upper positions, lower and upper velocities, efforts (5, n).
        settings: begin with the horizon T [s] and the share of the effort for braking.
        box: lower and upper accelerations (2, n), where to write [rad/s², m/s²].
    """
    for k in range(len(q)):
        box[0, k], box[1, k] = _bounds(q[k], v[k], B[k, k], limits[:, k], settings)


@compilable
def limits_bind(
    x: Array,
    B: Array,
    alpha: Array,
    u: Array,
    order: Array,
    limits: Array,
    settings: Array,
) -> bool:
    """Whether accelerations leave the box of (L.1) or torques their limits. Floats only.

    Args:
        x: joint positions and velocities (2n,) [rad, m; rad/s, m/s].
        B: joint inertia (n, n).
        alpha: joint accelerations (n,).
        u: torques in the order of the actuators (n,) [Nm, N].
        order: which joint each actuator drives (n,).
        limits: see `acceleration_box`.
        settings: see there.
    """
    n = len(u)
    for k in range(n):
        low, high = _bounds(x[k], x[n + k], B[k, k], limits[:, k], settings)
        if not (low <= alpha[k] <= high) or abs(u[k]) > limits[4, order[k]]:
            return True
    return False
