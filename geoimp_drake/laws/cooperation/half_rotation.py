"""Half of a rotation, as a quaternion and with its velocity and acceleration.

Half of Q is (Q + 1) / ‖Q + 1‖. It needs no angle and no axis, so nothing fails at ϑ = 0 or at ϑ =
π. Q and −Q have different halves, ϑ/2 and ϑ/2 − π about the same axis. The half is undefined only
at Q = −1, a whole turn, ϑ = 2π.
"""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import vector
from geoimp_drake.errors import OutOfDomainError
from geoimp_drake.rotations.components import wxyz
from geoimp_drake.rotations.quaternion import conjugate, product, rate
from geoimp_drake.typing import Array

__all__ = ["check_half_defined", "half_rotation", "half_rotation_motion", "is_half_defined"]

# η = cos(ϑ/2) at which a whole turn is reported: ϑ = 355°.
SMALLEST_ETA = -0.999


@compilable
def half_rotation(Q: Array) -> Array:
    """(4.4), (4.12) {cos(ϑ/4), sin(ϑ/4) r} (4,) of Q = {cos(ϑ/2), sin(ϑ/2) r}, 0 ≤ ϑ < 2π.

    Not defined at ϑ = 2π: call `check_half_defined` where ϑ may come near.
    """
    w, x, y, z = wxyz(Q)
    k = 1.0 / np.sqrt(2.0 + 2.0 * w)
    return vector(k * (1.0 + w), k * x, k * y, k * z)


@compilable
def half_rotation_motion(Q: Array, w: Array, dw: Array) -> tuple[Array, Array, Array]:
    """(4.12) The half rotation H of a moving Q, its angular velocity and acceleration.

    The derivatives of H follow from those of Q by Q + 1 = nH, with n = ‖Q + 1‖, n² = 2(1 + η).

    Args:
        Q: unit quaternion (4,).
        w: its angular velocity (3,), in the frame that Q turns, 1 for ¹Q_21 [rad/s].
        dw: the derivative of these components (3,) [rad/s²].

    Returns:
        H (4,), ω (3,) and ω̇ (3,) of H, in the same frame.
    """
    H = half_rotation(Q)
    n = np.sqrt(2.0 + 2.0 * Q[0])
    Q_dot = rate(Q, w)
    # Q̈ = ½ ω̇ * Q + ½ ω * Q̇, quaternion products of vectors.
    Q_ddot = rate(Q, dw) + rate(Q_dot, w)
    n_dot = Q_dot[0] / n
    H_dot = (Q_dot - n_dot * H) / n
    # A further term, a multiple of H, is left out: it adds nothing to ω̇.
    H_ddot = (Q_ddot - 2.0 * n_dot * H_dot) / n
    return H, _vector(H_dot, H), _vector(H_ddot, H)


@compilable
def is_half_defined(Q: Array) -> bool:
    """Whether half of a mutual orientation is defined: ϑ is at most 355°; floats only."""
    return bool(Q[0] > SMALLEST_ETA)


def check_half_defined(Q: Array) -> None:
    """Refuses a mutual orientation whose half is not defined; floats only.

    Raises:
        OutOfDomainError: ϑ is above 355°.
    """
    if not is_half_defined(Q):
        raise OutOfDomainError(
            f"The mutual orientation of the hands has η = {Q[0]:.6f}, ϑ_21 = "
            f"{2.0 * np.degrees(np.arccos(max(-1.0, Q[0]))):.1f}°; half of it is not defined at "
            f"360°. The hands have turned too far from each other since the start."
        )


@compilable
def _vector(H_rate: Array, H: Array) -> Array:
    """2 Ḣ * H⁻¹, its vector part: ω of Ḣ, and ω̇ of Ḧ, since Ḣ * (H⁻¹)˙ is a scalar."""
    return 2.0 * product(H_rate, conjugate(H))[1:]
