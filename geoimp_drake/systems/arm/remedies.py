"""Torques that compensate errors of an arm's model, added to those of its inner loop."""

from geoimp_drake.parts import remedies as part
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["Remedies"]


class Remedies(PartSystem):
    """Adds torques that compensate errors of the model to those of inverse dynamics.

    Each of three remedies acts if it is configured:

        integral               τ_I = B J† K_I ∫e dt,  e of C from E                     (R.1)
        friction               τ_F = F_c tanh(q̇_c / v_s) + F_v q̇_c,  q̇_c to follow C     (R.2)
        disturbance_observer   τ_d = −r,  ṙ = K (τ_dist − r),  by generalized momentum   (R.3)

    The observer subtracts the measured wrench, so its residual is the model's error. It does not
    know the friction that is fed forward, and so sees what the feedforward leaves. Integral and
    residual stay constant while the hand touches something, unless configured otherwise. The
    integral also stays constant while a torque is at its limit. With Coulomb friction the observer
    hunts in contact.

    Args:
        part: of `geoimp_drake.parts.remedies`, made for the arm.

    Raises:
        SignalError: an input is NaN or infinite.

    Ports:
        input torque: of inverse dynamics, in the order of the actuators (n) [Nm or N]
        input estimated_state: [q; v] of the arm as it was read (2n)
        input reference_motion: of C, in W (19)
        input wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6)
        output actuation: the sum of both torques, in the order of the actuators (n)
        output compensation: the torques added in this step (n) [Nm or N]
        output peak_effort: largest torque since the start as a fraction of the limit (n)
    """

    def __init__(self, part: part.Remedies):
        super().__init__(part)
