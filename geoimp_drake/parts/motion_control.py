"""The inner motion loop's law and gains."""

import numpy as np

from geoimp_drake.arm.state import ArmState
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.compilation.small_arrays import numbers
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE, QUATERNION
from geoimp_drake.laws.impedance.families import make_family
from geoimp_drake.laws.motion_control.orientation_control import ERROR_PER_ANGLE, orientation_law
from geoimp_drake.laws.motion_control.tracking_acceleration import tracking_acceleration
from geoimp_drake.parts.part import Memory, Now, Output
from geoimp_drake.parts.signals import check_frame_motion
from geoimp_drake.typing import Array
from geoimp_drake.validation import positive

__all__ = ["MotionControl"]


class MotionControl:
    """The part of `MotionController`; arguments and errors are the same.

    Attributes:
        gains: K_Do and K_Po, K_Dp and K_Pp (2, 3, 3) each [1/s, 1/s²].
        stiffness: a of a small [angle; displacement] (6): K_Po ∂ε/∂ϑ and K_Pp on their diagonals
            [1/s²].
        orientation_law: see `orientation_control.ORIENTATION_LAWS`.
        has_domain: whether there are attitudes at which the law is undefined.
    """

    def __init__(
        self,
        K_Pp: float = 2025.0,
        K_Dp: float = 65.0,
        K_Po: float = 4500.0,
        K_Do: float = 65.0,
        orientation: str = "quaternion",
    ):
        for name, value in (("K_Pp", K_Pp), ("K_Dp", K_Dp), ("K_Po", K_Po), ("K_Do", K_Do)):
            positive(value, name)
        self.orientation_law = orientation_law(orientation)
        self._law = compiled(tracking_acceleration(self.orientation_law))
        self.gains = tuple(
            np.array([k * np.eye(3) for k in part]) for part in ((K_Do, K_Po), (K_Dp, K_Pp))
        )
        self.stiffness = np.repeat([ERROR_PER_ANGLE[orientation] * K_Po, K_Pp], 3)
        # The family of the same name knows where the orientation error is defined.
        self._family = make_family(orientation, np.eye(3), np.eye(3), np.eye(3))
        self.has_domain = self._family.has_domain
        self.inputs = {"reference_motion": FRAME_MOTION_SIZE, "arm": object()}
        self.memory = Memory()
        self.outputs = (Output("task_acceleration", 6, self._write, tuple(self.inputs)),)

    def check(self, reference: Array, Q_WE: Array, port: str) -> None:
        """Raises an error, with the port's name, if the law cannot use a reference.

        Args:
            reference: motion of the frame to be tracked (19,).
            Q_WE: orientation of E (4,).
            port: the name in the error.

        Raises:
            SignalError: it is NaN or infinite, or its quaternion is not unit.
            SingularityError: the attitude leaves the domain of the orientation law.
            OutOfDomainError: the same.
        """
        check_frame_motion(reference, port)
        if self.has_domain:
            self._family.check_domain(numbers(reference[QUATERNION]), numbers(Q_WE))

    def acceleration(self, reference: Array, arm: ArmState) -> Array:
        """Returns the task acceleration a (6,) of (2.9) and of the orientation law, as (2.15).

        Args:
            reference: motion of the frame to be tracked (19,), in the domain of the law.
            arm: the arm.
        """
        a = np.full(6, np.nan)
        self._law(reference, arm.Q_WE, arm.p_WE, arm.V_WE, *self.gains, a)
        return a

    def _write(self, now: Now, a: Array) -> None:
        arm, motion = now["arm"], now["reference_motion"]
        if self.has_domain:
            self.check(motion, arm.Q_WE, now.port("reference_motion"))
        if not self._law(motion, arm.Q_WE, arm.p_WE, arm.V_WE, *self.gains, a):
            self.check(motion, arm.Q_WE, now.port("reference_motion"))
