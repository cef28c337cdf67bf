"""Inverse kinematics at velocity level: the joint references of an arm that takes positions."""

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import SingularityDamping
from geoimp_drake.parts import inverse_kinematics
from geoimp_drake.parts.joint_limits import LimitsConfig
from geoimp_drake.parts.masses import Masses
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["InverseKinematics"]


class InverseKinematics(PartSystem):
    """Makes the joint references with which E follows a frame C.

    Every period, with the arm's kinematics at q_d, (A.1)

        q̇_d = J†(V_c + K_x e) + (I − J†J) K_n (q_0 − q_d),   q_d ← q_d + Δt q̇_d,

    where e = [2 R_e ᵉε_ce; p_c − p_e] is the error of the reference, not of the arm. It reads the
    measured state at the start only. J† is damped near singularities. (A.1) may leave the limits of
    positions, velocities or efforts, or come near a singularity. Then the change of q̇_d in a
    period is the acceleration of (L.1) instead of that of (A.1), without a wrench. The output
    `slack` is what this leaves undone of C's acceleration; an impedance takes it to hold C back.

    Args:
        model: the arm.
        period: of the references [s].
        config: gains.
        damping: near singularities.
        limits: how the arm's limits are kept.
        masses: of the impedance, by which the task is weighed at a limit.

    Raises:
        ConfigurationError: a gain does not fit the period.
        SignalError: an input is NaN or infinite, or a quaternion is not unit.

    Ports:
        input estimated_state: [q; v] of the model instance, in the plant's order (2n)
        input reference_motion: of C in W (19)
        output joint_reference: [q_d; q̇_d] in the order of `estimated_state` (2n)
        output measured_motion: of E in W from `estimated_state`; accelerations are zero (19)
        output reference_error: e before the last step of the reference (6) [rad, m]
        output limited: `Limited`: which limits act on the reference, and the slack (10)
        output slack: part of C's acceleration that the limits leave undone (6) [rad/s², m/s²]
    """

    def __init__(
        self,
        model: ControlModel,
        period: float,
        config: inverse_kinematics.ReferenceConfig | None = None,
        damping: SingularityDamping | None = None,
        limits: LimitsConfig | None = None,
        masses: Masses | None = None,
    ):
        super().__init__(
            inverse_kinematics.InverseKinematics(model, period, config, damping, limits, masses)
        )
