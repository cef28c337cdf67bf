"""From one controller's torques to another's without a jump."""

from geoimp_drake.parts.hand_over import HandOver as HandOverPart
from geoimp_drake.parts.hand_over import desired_at_equilibrium
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["HandOver", "desired_at_equilibrium"]


class HandOver(PartSystem):
    """Passes the torques of one of two controllers on, and changes over between them smoothly.

    When the other one is selected, the difference of the torques at that instant fades out,

        τ = τ_new + (1 − s(t/T)) (τ_old − τ_new)(0),

    where s is the fifth-order polynomial of `smooth_step`. The controller that takes over has to
    run by then, started where the arm is. Start an impedance controller with the D of
    `desired_at_equilibrium`. `preset` an `IndustrialController` to the output `torque`.

    Args:
        num_joints: n.
        fade: T, how long the difference takes to fade [s].
        period: of the samples [s].

    Raises:
        ConfigurationError: a time is not positive.
        SignalError: a torque that is passed on is NaN or infinite.

    Ports:
        input torque_1: of the first controller (n)
        input torque_2: of the second (n)
        input selected: 0 for the first, 1 for the second (1)
        output torque: for the arm (n)
    """

    def __init__(self, num_joints: int, fade: float = 0.5, period: float = 1e-3):
        super().__init__(HandOverPart(num_joints, fade, period))
