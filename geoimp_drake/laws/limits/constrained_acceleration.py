"""The quadratic program whose minimum is the joint acceleration within the limits."""

import numpy as np

from geoimp_drake.laws.limits.acceleration_box import acceleration_box
from geoimp_drake.typing import Array

__all__ = ["constrained_acceleration"]


def constrained_acceleration(
    J: Array,
    b: Array,
    B: Array,
    c: Array,
    x: Array,
    alpha_0: Array,
    W: Array,
    limits: Array,
    settings: Array,
) -> tuple[Array, Array, Array, Array]:
    """Returns H, f and the bounds of the program (L.1). Floats only.

        min ½ (Jα − b)ᵀ W (Jα − b) + ½ Σ wᵢ λᵢ² (vᵢᵀ(α + k q̇))² + ½ ρ (α − α₀)ᵀ B (α − α₀)
        over α in the box of acceleration_box with |Bα + c| ≤ τ̄                            (L.1)

    With J = UΣVᵀ, λᵢ² = λ₀²(1 − σᵢ²/σ₀²) for each σᵢ < σ₀ and zero for the others, and wᵢ = uᵢᵀWuᵢ.
    So the damping acts only along the nearly lost directions vᵢ, where the joints come to rest.
    With W the mass matrix of the impedance, the limits act on the task like an ideal constraint
    wrench, by Gauss's principle. So free directions keep their law.

    Args:
        J: Jacobian of the end effector (6, n).
        b: a − J̇q̇, what the task asks of Jα (6,).
        B: joint inertia (n, n).
        c: Cq̇ + Fq̇ + g + Jᵀh (n,) [Nm, N].
        x: joint positions and velocities (2n,).
        alpha_0: the acceleration without limits, whose null-space motion is kept (n,).
        W: weight of the task, symmetric positive definite (6, 6).
        limits: see `acceleration_box` (5, n).
        settings: T [s], the share of the effort for braking, σ₀, λ₀, k [1/s] and ρ (6,). With a
            mass matrix W, ρ has no unit.

    Returns:
        H (n, n) and f (n,) of ½αᵀHα + fᵀα, and lower and upper bounds (2n,) of α and of Bα.
    """
    n = J.shape[1]
    threshold, factor, rate, rho = settings[2], settings[3], settings[4], settings[5]
    q, v = x[:n].copy(), x[n:].copy()
    WJ = W @ J
    H, f = J.T @ WJ + rho * B, -(WJ.T @ b) - rho * (B @ alpha_0)
    U, s, Vt = np.linalg.svd(J, full_matrices=False)
    for i in range(6):
        if s[i] < threshold:
            u, lost = U[:, i].copy(), Vt[i].copy()
            weight = (u @ (W @ u)) * factor**2 * (1.0 - (s[i] / threshold) ** 2)
            H += weight * np.outer(lost, lost)
            f += weight * rate * (lost @ v) * lost
    bounds = np.empty((2, 2 * n))
    acceleration_box(q, v, B, limits, settings, bounds[:, :n])
    bounds[0, n:] = -limits[4] - c
    bounds[1, n:] = limits[4] - c
    return H, f, bounds[0], bounds[1]
