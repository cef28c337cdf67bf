"""The six-DOF impedance solved for the motion of C: translation and rotation in one call."""

from collections.abc import Callable
from functools import cache

import numpy as np

from geoimp_drake.compiled import compilable
from geoimp_drake.laws.coupled_stiffness import without_coupling
from geoimp_drake.laws.motion_vector import (
    ACCELERATION,
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_STATE_SIZE,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
    VELOCITY,
    is_finite,
    is_frame_motion,
)
from geoimp_drake.laws.translational_impedance import compliant_acceleration
from geoimp_drake.rotations.quaternion import normalized, rate
from geoimp_drake.typing import Array

__all__ = ["compliant_motion", "frame_state_rate", "has_diverged"]

# No arm is that far away or that fast [m, rad, m/s, rad/s].
_DIVERGED = 1e6


@compilable
def has_diverged(state: Array) -> bool:
    """Whether an entry of the state of C (13,) is beyond all reason, or NaN; floats only."""
    return not np.abs(state).max() < _DIVERGED


@compilable
def frame_state_rate(motion: Array, state_rate: Array) -> None:
    """Writes the derivative of a frame's state (13,): Q̇ = ½ [−εᵀ; E(η, ε)] ω, ṗ = v, ω̇ and v̇.

    Args:
        motion: of the frame (19,).
        state_rate: where to write.
    """
    state_rate[QUATERNION] = rate(motion[QUATERNION], motion[ANGULAR_VELOCITY])
    state_rate[POSITION] = motion[LINEAR_VELOCITY]
    state_rate[VELOCITY] = motion[ACCELERATION]


@cache
def compliant_motion(angular_acceleration: Callable[..., Array]) -> Callable[..., bool]:
    """Returns the law of the six-DOF impedance for a family of orientations.

    Args:
        angular_acceleration: the family's law, solved for ω̇_c; see
            `orientation_impedance.OrientationImpedance.law`.
    """

    def law(
        state: Array,
        desired: Array,
        wrench: Array,
        translation: Array,
        rotation: Array,
        coupling: Array,
        parts: Array,
        motion: Array,
    ) -> bool:
        """Writes the motion of C; says whether it could. Floats only.

        Args:
            state: of C, a frame motion without its accelerations (13,).
            desired: motion of D (19,).
            wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6,).
            translation: M_p⁻¹, D_p and K_p (3, 3, 3), in W; with a coupling, K_p is in D.
            rotation: M_o⁻¹, D_o and K_o (3, 3, 3).
            coupling: K_c (3, 3), in D [N].
            parts: whether translation, rotation and coupling take part (3,); what has no
                impedance follows D.
            motion: of C (19,), where to write.
        """
        if not is_frame_motion(desired) or not is_finite(wrench) or has_diverged(state):
            return False
        motion[:FRAME_STATE_SIZE] = state
        motion[QUATERNION] = normalized(state[QUATERNION])
        Q_WD, Q_WC = desired[QUATERNION], motion[QUATERNION]
        dp = desired[POSITION] - motion[POSITION]
        moment, force, K_p = wrench[:3], wrench[3:], translation[2]
        if parts[2]:
            moment, force, K_p = without_coupling(Q_WD, Q_WC, dp, moment, force, K_p, coupling)
        if parts[1]:
            motion[ANGULAR_ACCELERATION] = angular_acceleration(
                Q_WD,
                desired[ANGULAR_VELOCITY],
                desired[ANGULAR_ACCELERATION],
                Q_WC,
                motion[ANGULAR_VELOCITY],
                moment,
                rotation[0],
                rotation[1],
                rotation[2],
            )
        else:
            motion[QUATERNION] = Q_WD
            motion[ANGULAR_VELOCITY] = desired[ANGULAR_VELOCITY]
            motion[ANGULAR_ACCELERATION] = desired[ANGULAR_ACCELERATION]
        if parts[0]:
            motion[LINEAR_ACCELERATION] = compliant_acceleration(
                desired[LINEAR_ACCELERATION],
                desired[LINEAR_VELOCITY] - motion[LINEAR_VELOCITY],
                dp,
                force,
                translation[0],
                translation[1],
                K_p,
            )
        else:
            motion[POSITION] = desired[POSITION]
            motion[LINEAR_VELOCITY] = desired[LINEAR_VELOCITY]
            motion[LINEAR_ACCELERATION] = desired[LINEAR_ACCELERATION]
        return True

    return law
