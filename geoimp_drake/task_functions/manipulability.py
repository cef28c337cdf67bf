"""Manipulability, the distance from kinematic singularities."""

import math

import numpy as np

from geoimp_drake.errors import SingularityError
from geoimp_drake.laws.redundancy.geometric_jacobian import jacobian_adjoint, jacobian_rate
from geoimp_drake.task_functions.task_function import Instant, TaskValue

__all__ = ["Manipulability"]


class Manipulability:
    """w = √det(JJᵀ), zero at singularities; climb it (k_β > 0).

    Its gradient is ∂w/∂q_i = w tr(J⁺ ∂J/∂q_i) with J⁺ = Jᵀ(JJᵀ)⁻¹. J is the geometric Jacobian of E
    in SI units. So the choice of rad and m sets the weight of rotations against translations, and
    of a track against revolute joints.

    Raises:
        SingularityError: J is exactly singular, so that w has no gradient.
    """

    def evaluate(self, instant: Instant) -> TaskValue:
        """Returns w and its derivatives."""
        J, v = instant.arm.Jv_V_WE, instant.v
        A = J @ J.T
        w = math.sqrt(max(0.0, float(np.linalg.det(A))))
        if w == 0.0:
            raise SingularityError(
                "The manipulability is zero: the arm is at a kinematic singularity, where it has "
                "no gradient. Start from another posture."
            )
        A_inverse, dJ = np.linalg.inv(A), jacobian_rate(J, v)
        # G = (J⁺)ᵀ and its rate.
        G = A_inverse @ J
        J_dJt = J @ dJ.T
        dG = A_inverse @ (dJ - (J_dJt + J_dJt.T) @ G)
        S, dS = jacobian_adjoint(J, G), jacobian_adjoint(dJ, G) + jacobian_adjoint(J, dG)
        slope = (J * S).sum(axis=0)  # tr(J⁺ ∂J/∂q_i)
        slope_rate = (dJ * S + J * dS).sum(axis=0)
        dw = w * float(slope @ v)
        return TaskValue(w, dw, w * slope, dw * slope + w * slope_rate)
