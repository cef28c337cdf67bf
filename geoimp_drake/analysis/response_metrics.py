"""Published metrics of compliant arms, from signals over time.

Each takes samples over time, and defines what its name means.
"""

import numpy as np

from geoimp_drake.analysis.encounter import contact_metrics
from geoimp_drake.typing import Array

__all__ = [
    "force_overshoot",
    "ideal_response",
    "impedance_fidelity",
    "impedance_power",
    "jerk",
    "root_mean_square",
    "time_above",
]


def root_mean_square(values: Array) -> float:
    """Returns √(mean of the squares) of values over time (N), in their unit."""
    return float(np.sqrt(np.mean(np.square(values))))


def force_overshoot(times: Array, force: Array) -> float:
    """Returns the excess of the peak over the force at rest, divided by that force; 0 for none [-].

    The force at rest is the mean over the last second, as in `contact_metrics`. If that is zero,
    the result is infinite.

    Args:
        times: of the samples (N) [s].
        force: size of the contact force (N) [N].
    """
    metrics = contact_metrics(times, force, 0.0)
    peak, steady = metrics["peak_force"], metrics["steady_force"]
    return peak / steady - 1.0 if steady > 0.0 else np.inf


def time_above(times: Array, force: Array, limit: float) -> float:
    """Returns how long a force exceeds a limit [s]; a sample stands for the time since the last.

    Args:
        times: of the samples (N) [s].
        force: its size (N) [N].
        limit: the one to exceed [N].
    """
    return float(np.diff(times) @ (force[1:] > limit))


def jerk(times: Array, acceleration: Array) -> Array:
    """Returns ‖dv̇/dt‖ over time (N) [m/s³], by central differences.

    Args:
        times: of the samples (N) [s].
        acceleration: v̇ of a point (N×3) [m/s²].
    """
    rate = np.gradient(acceleration, times, axis=0)
    return np.asarray(np.linalg.norm(rate, axis=1))


def ideal_response(
    times: Array, force: Array, mass: Array, damping: Array, stiffness: Array
) -> tuple[Array, Array]:
    """Returns x and ẋ (N×3) [m, m/s] of M ẍ + D ẋ + K x = f from rest, by the trapezoidal rule.

    Args:
        times: of the samples (N), evenly spaced [s].
        force: on the body (N×3) [N].
        mass: M (3×3) [kg].
        damping: D (3×3) [Ns/m].
        stiffness: K (3×3) [N/m].
    """
    half = 0.5 * (times[1] - times[0])
    A = np.block(
        [
            [np.zeros((3, 3)), np.eye(3)],
            [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)],
        ]
    )
    inputs = np.hstack((np.zeros_like(force), np.linalg.solve(mass, force.T).T))
    left, right = np.linalg.inv(np.eye(6) - half * A), np.eye(6) + half * A
    states = np.zeros((len(times), 6))
    for k in range(1, len(times)):
        states[k] = left @ (right @ states[k - 1] + half * (inputs[k - 1] + inputs[k]))
    return states[:, :3], states[:, 3:]


def impedance_fidelity(power: Array, ideal: Array) -> float:
    """Returns the deviation of a step response's power from that of the configured impedance [W].

    It is the root mean square of P − P*. Dos Santos et al. compare powers in this way in Leveraging
    Port-Hamiltonian Theory for Impedance Control Benchmarking (2025). Small is good, and power that
    leaks into other directions counts.

    Args:
        power: P, see `impedance_power` (N) [W].
        ideal: P*, of the response of the impedance itself (N) [W].
    """
    return root_mean_square(power - ideal)


def impedance_power(
    displacement: Array, velocity: Array, damping: Array, stiffness: Array
) -> Array:
    """Returns −ẋᵀ(D ẋ + K x) over time (N) [W], the power of springs and dampers on the arm.

    Args:
        displacement: x from the equilibrium (N×3) [m].
        velocity: ẋ (N×3) [m/s].
        damping: D (3×3) [Ns/m].
        stiffness: K (3×3) [N/m].
    """
    force = velocity @ damping.T + displacement @ stiffness.T
    return np.asarray(-np.sum(velocity * force, axis=1))
