"""Inverse dynamics, the inner loop of every controller."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import local
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.typing import Array

__all__ = ["actuation", "inverse_dynamics", "peak_effort"]


@compilable
def inverse_dynamics(
    B: Array, alpha: Array, Cv: Array, Fv: Array, g: Array, J: Array, h: Array
) -> Array:
    """(2.3) τ = Bα + Cq̇ + Fq̇ + g + Jᵀh, which gives (2.4) q̈ = α.

    Args:
        B: joint inertia (n, n), reflected rotor inertia included.
        alpha: the joints' desired acceleration (n,) [rad/s², m/s²].
        Cv: Coriolis and centrifugal generalized forces C(q, q̇)q̇ (n,) [Nm, N].
        Fv: viscous friction Fq̇ (n,), with the sign of q̇.
        g: gravity's term (n,): τ = g holds the arm at rest.
        J: Jacobian of the end effector (6, n), its rows [angular; linear], in W.
        h: wrench [moment; force] (6,) by the end effector on the environment, about the end
            effector's origin, in W [Nm, N].

    Returns:
        The actuation τ (n,) [Nm, N].
    """
    return B @ alpha + Cv + Fv + g + J.T @ h


@compilable
def actuation(
    B: Array,
    alpha: Array,
    Cv: Array,
    Fv: Array,
    g: Array,
    J: Array,
    h: Array,
    order: Array,
    u: Array,
) -> bool:
    """Writes τ of `inverse_dynamics` into u (n,) in the order of the actuators.

    Returns False, without writing, if a torque is not finite, as with an α or h that is not.
    `order` has the joint of each actuator (n,). Floats only.
    """
    tau = local(inverse_dynamics(B, alpha, Cv, Fv, g, J, h))
    if not is_finite(tau):
        return False
    for k in range(len(u)):
        u[k] = tau[order[k]]
    return True


@compilable
def peak_effort(u: Array, limits: Array, peak: Array) -> int:
    """Updates the largest |u|/limit so far (n,); returns which have just passed their limits.

    The result is a number whose bit k stands for actuator k. It is nearly always zero, and cheaper
    than an array.
    """
    passed = 0
    for k in range(len(u)):
        effort = max(peak[k], abs(u[k]) / limits[k])
        if peak[k] <= 1.0 < effort:
            passed |= 1 << k
        peak[k] = effort
    return passed
