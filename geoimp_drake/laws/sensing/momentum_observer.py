"""The generalized-momentum observer: external joint torques from motion and motor torques.

A. De Luca, R. Mattone, "Actuator failure detection and isolation using generalized momenta" (2003);
the chapter measures the wrench with a wrist sensor.

With p = B q̇ and Ḃ = C + Cᵀ, (2.2) gives ṗ = τ + Ḃ q̇ − C q̇ − F q̇ − g + τ_ext, so that

    r = K (p − p_0 − ∫ (τ + Ḃ q̇ − C q̇ − F q̇ − g + r) dt)

obeys ṙ = K (τ_ext − r): each joint's residual is its external torque behind a low-pass of 1/K.
Sampled, the residual is the solution of the implicit step, stable for every gain. Floats only.
"""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.typing import Array

__all__ = ["momentum_residual"]


@compilable
def momentum_residual(
    momentum: Array, before: Array, forces: Array, residual: Array, gain: float, elapsed: float
) -> Array:
    """(R.3) r at the end of a step: r = (r_before + K (p − p_before − Δt n)) / (1 + K Δt).

    Args:
        momentum: p = B q̇ (n,).
        before: p at the beginning of the step (n,).
        forces: n = τ + Ḃ q̇ − C q̇ − F q̇ − g over the step (n,) [Nm, N].
        residual: r at the beginning (n,) [Nm, N].
        gain: K [1/s].
        elapsed: Δt [s].
    """
    return (residual + gain * (momentum - before - elapsed * forces)) / (1.0 + gain * elapsed)
