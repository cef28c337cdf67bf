"""The inner motion loop: the end effector's acceleration that makes E track a reference frame."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.impedance.families import make_family
from geoimp_drake.laws.impedance.orientation_impedance import overrides
from geoimp_drake.laws.motion_control.orientation_control import orientation_law
from geoimp_drake.laws.motion_control.tracking_acceleration import tracking_acceleration
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.frame_motion import (
    QUATERNION,
    check_frame_motion,
    frame_motion_vector,
)
from geoimp_drake.typing import Array
from geoimp_drake.validation import positive

__all__ = ["MotionController"]


class MotionController(Block):
    """Computes the task acceleration a = [a_o; a_p] that makes E track a reference frame.

    Position (2.9) and orientation (2.15), or another of (2.10), (2.12), (2.13):

        a_p = p̈_d + K_Dp Δṗ_de + K_Pp Δp_de
        a_o = ω̇_d + K_Do Δω_de + K_Po R_e ᵉε_de

    The reference is D for pure motion control, and C under impedance control: one wire changes,
    no law does.

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
        super().__init__()
        for name, value in (("K_Pp", K_Pp), ("K_Dp", K_Dp), ("K_Po", K_Po), ("K_Do", K_Do)):
            positive(value, name)
        self._law = compiled(tracking_acceleration(orientation_law(orientation)))
        self._gains = tuple(
            np.array([k * np.eye(3) for k in part]) for part in ((K_Do, K_Po), (K_Dp, K_Pp))
        )
        # The family of the same name knows where the orientation error is defined.
        self._family = make_family(orientation, np.eye(3), np.eye(3), np.eye(3))
        self._has_domain = overrides(self._family, "check_domain")
        self._reference = self.DeclareVectorInputPort("reference_motion", frame_motion_vector())
        self._arm = self.DeclareAbstractInputPort("arm", AbstractValue.Make(object()))
        self.DeclareVectorOutputPort(
            "task_acceleration",
            6,
            self._calc_acceleration,
            {self.input_port_ticket(port.get_index()) for port in (self._reference, self._arm)},
        )

    @property
    def gains(self) -> tuple[Array, Array]:
        """K_Do and K_Po, K_Dp and K_Pp (2, 3, 3) each [1/s, 1/s²]."""
        orientation, position = self._gains
        return orientation, position

    def _calc_acceleration(self, context: Context, output: BasicVector) -> None:
        arm, motion = self._arm.Eval(context), self._reference.Eval(context)
        if self._has_domain:
            self._check(motion)
            self._family.check_domain(motion[QUATERNION], arm.Q_WE)
        a = output.get_mutable_value()
        if not self._law(motion, arm.Q_WE, arm.p_WE, arm.V_WE, *self._gains, a):
            self._check(motion)

    def _check(self, motion: Array) -> None:
        check_frame_motion(motion, f"{self.get_name()}:reference_motion")
