"""The six-DOF impedance solved for the motion of C: translation and rotation in one call."""

from collections.abc import Callable
from functools import cache

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import sized
from geoimp_drake.laws.frame_motion import (
    ACCELERATION,
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    FRAME_STATE_SIZE,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
    VELOCITY,
    is_frame_motion,
)
from geoimp_drake.laws.impedance.coupled_damping import without_damping
from geoimp_drake.laws.impedance.coupled_stiffness import without_coupling
from geoimp_drake.laws.impedance.translational_impedance import compliant_acceleration, turned
from geoimp_drake.rotations.quaternion import normalized, rate, to_rotation
from geoimp_drake.typing import Array

__all__ = ["compliant_motion", "frame_state_rate", "has_diverged"]

# No arm is as far away, as fast or as heavily loaded as this [m, rad, …, N, Nm].
_DIVERGED = 1e6


@compilable
def has_diverged(signal: Array) -> bool:
    """Whether an entry of a state of C or of a wrench is implausibly large, or NaN."""
    within = True
    for entry in signal:
        within = within and abs(entry) < _DIVERGED
    return not within


@compilable
def frame_state_rate(motion: Array, state_rate: Array) -> None:
    """Writes the derivative of a frame's state (13,): Q̇ = ½ [−εᵀ; E(η, ε)] ω, ṗ = v, ω̇ and v̇.

    Args:
        motion: of the frame (19,).
        state_rate: where to write.
    """
    C = sized(motion, FRAME_MOTION_SIZE)
    state_rate[QUATERNION] = rate(C[QUATERNION], C[ANGULAR_VELOCITY])
    state_rate[POSITION] = C[LINEAR_VELOCITY]
    state_rate[VELOCITY] = C[ACCELERATION]


@cache
def compliant_motion(angular_acceleration: Callable[..., Array]) -> Callable[..., bool]:
    """Returns the law of the six-DOF impedance for an orientation family.

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
        """Writes the motion of C; returns False if an input is unusable.

        Args:
            state: of C, a frame motion without its accelerations (13,).
            desired: motion of D (19,).
            wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6,).
            translation: M_p⁻¹, D_p and K_p (3, 3, 3), in W or in D; with K_c, K_p is in D.
            rotation: M_o⁻¹, D_o and K_o (3, 3, 3), in C or in the family's coordinates.
            coupling: K_c, in D [N], and D_c, its rows in C and its columns in the axes of D_p [Ns]
                (2, 3, 3).
            parts: whether translation, rotation and K_c take part, whether `translation` is in D,
                and whether D_c takes part (5,); a part without impedance follows D.
            motion: of C (19,), where to write.
        """
        if not is_frame_motion(desired) or has_diverged(wrench) or has_diverged(state):
            return False
        D, C, h = (
            sized(desired, FRAME_MOTION_SIZE),
            sized(state, FRAME_STATE_SIZE),
            sized(wrench, 6),
        )
        motion[:FRAME_MOTION_SIZE] = D  # a part without impedance follows D
        Q_WD, Q_WC, dp = D[QUATERNION], normalized(C[QUATERNION]), D[POSITION] - C[POSITION]
        moment, force = h[:3], h[3:]
        M_inv, D_p, K_p = (
            sized(translation[0], 3, 3),
            sized(translation[1], 3, 3),
            sized(translation[2], 3, 3),
        )
        if parts[2]:
            K_c = sized(coupling[0], 3, 3)
            moment, force, K_p = without_coupling(Q_WD, Q_WC, dp, moment, force, K_p, K_c)
        if parts[3]:
            R_WD = to_rotation(Q_WD)
            M_inv, D_p = turned(M_inv, R_WD), turned(D_p, R_WD)
            if not parts[2]:
                K_p = turned(K_p, R_WD)
        if parts[4]:
            D_c = sized(coupling[1], 3, 3)
            if parts[3]:
                D_c = D_c @ to_rotation(Q_WD).T
            moment, force = without_damping(
                to_rotation(Q_WC),
                D[ANGULAR_VELOCITY] - C[ANGULAR_VELOCITY],
                D[LINEAR_VELOCITY] - C[LINEAR_VELOCITY],
                moment,
                force,
                D_c,
            )
        if parts[1]:
            motion[QUATERNION] = Q_WC
            motion[ANGULAR_VELOCITY] = C[ANGULAR_VELOCITY]
            motion[ANGULAR_ACCELERATION] = angular_acceleration(
                Q_WD,
                D[ANGULAR_VELOCITY],
                D[ANGULAR_ACCELERATION],
                Q_WC,
                C[ANGULAR_VELOCITY],
                moment,
                sized(rotation[0], 3, 3),
                sized(rotation[1], 3, 3),
                sized(rotation[2], 3, 3),
            )
        if parts[0]:
            motion[POSITION] = C[POSITION]
            motion[LINEAR_VELOCITY] = C[LINEAR_VELOCITY]
            motion[LINEAR_ACCELERATION] = compliant_acceleration(
                D[LINEAR_ACCELERATION],
                D[LINEAR_VELOCITY] - C[LINEAR_VELOCITY],
                dp,
                force,
                M_inv,
                D_p,
                K_p,
            )
        return True

    return law
