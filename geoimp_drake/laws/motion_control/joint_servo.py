"""The servo of one joint in an industrial control unit: PID, without a model of the arm."""

import numpy as np

from geoimp_drake.typing import Array

__all__ = ["servo_integral", "servo_torque"]


def servo_torque(kp: Array, kd: Array, error: Array, error_rate: Array, integral: Array) -> Array:
    """Returns τ = k_p (q_d − q) + k_d (q̇_d − q̇) + z, each joint on its own.

    Args:
        kp: proportional gains (n) [Nm/rad or N/m].
        kd: derivative gains (n) [Nm s/rad or N s/m].
        error: q_d − q (n) [rad or m].
        error_rate: q̇_d − q̇ (n) [rad/s or m/s].
        integral: z, the integral part (n) [Nm or N].
    """
    return kp * error + kd * error_rate + integral


def servo_integral(ki: Array, error: Array, integral: Array, limit: Array, period: float) -> Array:
    """Returns the integral part of the next sample, z + k_i (q_d − q) Δt within ±limit.

    Args:
        ki: integral gains (n) [Nm/(rad s) or N/(m s)].
        error: q_d − q (n) [rad or m].
        integral: z (n) [Nm or N].
        limit: greatest |z| (n) [Nm or N].
        period: Δt [s].
    """
    return np.clip(integral + ki * error * period, -limit, limit)
