"""The inner motion loop: the end effector's acceleration that makes E track a reference frame."""

from geoimp_drake.parts.motion_control import MotionControl
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["MotionController"]


class MotionController(PartSystem):
    """Computes the task acceleration a = [a_o; a_p] that makes E track a reference frame.

    Position (2.9) and orientation (2.15), or another of (2.10), (2.12), (2.13):

        a_p = p̈_d + K_Dp Δṗ_de + K_Pp Δp_de
        a_o = ω̇_d + K_Do Δω_de + K_Po R_e ᵉε_de

    The reference is D for pure motion control, and C under impedance control: only one
    wire changes.

    Args:
        K_Pp, K_Dp: position gains, k I each [1/s², 1/s].
        K_Po, K_Do: orientation gains, k I each [1/s², 1/s].
        orientation: the orientation law, a name of
            `geoimp_drake.laws.motion_control.orientation_control.ORIENTATION_LAWS`.

    Raises:
        ConfigurationError: a gain is not positive or the law's name is unknown.
        SingularityError: an attitude at which the orientation error is not defined.
        SignalError: the reference is NaN or infinite, or its quaternion is not unit.

    Ports:
        input reference_motion: of the frame to be tracked, in W (19)
        input arm: ArmState
        output task_acceleration: a of E in W, [angular; linear] (6) [rad/s², m/s²]
    """

    def __init__(
        self,
        K_Pp: float = 2025.0,
        K_Dp: float = 65.0,
        K_Po: float = 4500.0,
        K_Do: float = 65.0,
        orientation: str = "quaternion",
    ):
        super().__init__(MotionControl(K_Pp, K_Dp, K_Po, K_Do, orientation))
