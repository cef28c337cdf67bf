"""Energy that a ringing sampled contact injects, and the damping that this raises."""

from geoimp_drake.typing import Array

__all__ = ["alternating_work", "raised_damping"]


def alternating_work(h: Array, z: Array, means: Array, share: float) -> float:
    """(L.6) (h − h̄)ᵀ(z − z̄) [J], the work of what alternates in a step; updates the means.

    Pressing and moving slowly also does work, which is no ringing: therefore h̄ and z̄, which
    follow h and z with a lag, are subtracted. The wrench must be that of the step in which the end
    effector moved by z. The sign is wrong once the wrench lags by a quarter of an oscillation.
    Floats only.

    Args:
        h: wrench by the end effector on the environment in the step (6,) [Nm, N].
        z: displacement of the end effector in that step, [angular; linear] (6,) [rad, m].
        means: h̄ and z̄ (2, 6), updated.
        share: the part of the difference by which they are updated.
    """
    means[0] += share * (h - means[0])
    means[1] += share * (z - means[1])
    return float((h - means[0]) @ (z - means[1]))


def raised_damping(level: float, shares: tuple[float, float], *, rings: bool) -> float:
    """(L.7) λ := λ + Δt/T₁ up to 1 while it rings, λ := λ(1 − Δt/T₂) otherwise.

    The damping is that of the impedance times 1 + λ(c − 1).

    Args:
        level: λ, from 0 to 1.
        shares: Δt/T₁ and Δt/T₂.
        rings: whether the contact injects alternating energy.
    """
    rise, fall = shares
    return min(level + rise, 1.0) if rings else level * (1.0 - fall)
