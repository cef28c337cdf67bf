"""The joint acceleration of a nonredundant arm from the acceleration of its end effector."""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.errors import SingularityError
from geoimp_drake.laws.dynamics.linear_equations import solution
from geoimp_drake.typing import Array

__all__ = ["check_regular", "resolved_acceleration"]


@compilable
def resolved_acceleration(J: Array, Jdot_v: Array, a: Array) -> Array:
    """(2.5) α = J⁻¹(a − J̇q̇), which gives (2.6) v̇_e = a.

    Args:
        J: Jacobian of the end effector (6, 6), its rows [angular; linear], in W.
        Jdot_v: bias acceleration J̇q̇ (6,).
        a: the desired acceleration [a_o; a_p] (6,) of the end effector [rad/s², m/s²].

    Returns:
        α (6,) [rad/s²].

    Raises:
        numpy.linalg.LinAlgError: J is exactly singular. Near a singularity α is large, not refused:
            see `check_regular`.
    """
    return solution(J, a - Jdot_v)


def check_regular(J: Array, smallest: float = 1e-6) -> None:
    """Refuses a posture at a kinematic singularity; floats only.

    Args:
        J: Jacobian of the end effector (6, n) with n ≥ 6.
        smallest: the bound on its smallest singular value, in rad and m.

    Raises:
        SingularityError: the smallest singular value of J is not above `smallest`.
    """
    sigma = float(np.linalg.svd(J, compute_uv=False)[-1])
    if not sigma > smallest:
        raise SingularityError(
            f"the arm is at a kinematic singularity: the smallest singular value of its Jacobian "
            f"is {sigma:.3g}, not above {smallest:g}. Choose another posture."
        )
