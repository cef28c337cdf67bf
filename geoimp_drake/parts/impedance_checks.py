"""Whether signals can be used by an impedance, and whether its orientation family still can."""

import logging

import numpy as np

from geoimp_drake.compilation.small_arrays import numbers
from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.laws.frame_motion import FRAME_STATE_SIZE, QUATERNION, VELOCITY
from geoimp_drake.laws.impedance import coupled_stiffness
from geoimp_drake.laws.impedance.compliant_motion import has_diverged
from geoimp_drake.laws.impedance.families import OrientationImpedance
from geoimp_drake.parts.part import Now
from geoimp_drake.parts.signals import check_frame_motion, check_wrench
from geoimp_drake.rotations import quaternion
from geoimp_drake.typing import Array
from geoimp_drake.validation import finite_array

__all__ = ["ImpedanceChecks", "at_rest", "checked_coupling"]

_log = logging.getLogger("drake")

# cond(T) above which a warning says that the family's representation is about to fail.
_ILL_CONDITIONED = 10.0

# What to do if the motion diverges.
_REMEDY = (
    "The integration step must stay well below M/D; shorten the simulator's max_step_size, or "
    "lower the damping or raise the mass of the impedance."
)


class ImpedanceChecks:
    """The checks of an impedance's signals; a piece of `Impedance`.

    Args:
        rotation: the orientation family with its gains.
        rotates: whether rotation is compliant.
        remedy: what to do if the motion diverges; a default for an end effector.

    Attributes:
        has_domain: whether there are attitudes at which the law is undefined.
        has_conditioning: whether its representation may come near a singularity.
    """

    def __init__(self, rotation: OrientationImpedance, rotates: bool, remedy: str = ""):
        self._rotation, self._remedy = rotation, remedy or _REMEDY
        self.has_domain = rotates and rotation.has_domain
        self.has_conditioning = rotates and rotation.has_conditioning

    def check(self, now: Now, desired: Array, wrench: Array, state: Array) -> None:
        """Raises an error, with the port's name, if the law cannot use a signal.

        Args:
            now: has the ports' names and that of the system.
            desired: motion of D (19,).
            wrench: at the end effector (6,).
            state: of C (13,).

        Raises:
            SignalError: a signal is not finite, a quaternion not unit, or C has diverged.
            SingularityError: the attitude leaves the domain of the family.
        """
        desired, wrench, state = map(numbers, (desired, wrench, state))
        check_frame_motion(desired, now.port("desired_motion"))
        check_wrench(wrench, now.port("wrench"))
        if has_diverged(state):
            raise SignalError(
                f"{now.system}: the motion of C has diverged, an entry of its state is "
                f"{state[np.argmax(np.abs(state))]:.3g} while the wrench has "
                f"{wrench[np.argmax(np.abs(wrench))]:.3g}. {self._remedy}"
            )
        if self.has_domain:
            C = quaternion.normalized(state[QUATERNION])
            self._rotation.check_domain(desired[QUATERNION], C)

    def is_ill_conditioned(self, now: Now, D: Array, C: Array) -> bool:
        """Returns whether the family is near its singularity, and then warns.

        Args:
            now: has the time and the system's name.
            D: motion of D (19,).
            C: motion of C (19,).
        """
        conditioning = self._rotation.conditioning(D[QUATERNION], C[QUATERNION])
        if conditioning <= _ILL_CONDITIONED:
            return False
        _log.warning(
            f"{now.system}: at t = {now.time:.3f} s the orientation family "
            f"'{self._rotation.name}' comes near its singularity, cond(T) = "
            f"{conditioning:.1f}; its moments lose meaning there. The quaternion has none."
        )
        return True


def at_rest(measured: Array, port: str) -> Array:
    """Returns the state of C (13,) at rest on a measured motion (19,) from a port."""
    check_frame_motion(measured, port)
    state: Array = measured[:FRAME_STATE_SIZE].copy()
    state[VELOCITY] = 0.0
    return state


def checked_coupling(K_c: Array, K_p: Array, rotation: OrientationImpedance, axes: str) -> Array:
    """Returns a coupling K_c (3, 3) that an impedance can have with its K_p and its family.

    Raises:
        ConfigurationError: the family has no coupling, one part has no impedance, K_c is not
            finite, or the 6×6 stiffness is not positive definite.
    """
    if rotation.name != "quaternion" or axes != "both":
        raise ConfigurationError(
            f"A coupling K_c is defined for the orientation family 'quaternion' on both parts; "
            f"here the family is '{rotation.name}' and the axes are '{axes}'."
        )
    coupling = finite_array(K_c, "K_c", (3, 3))
    coupled_stiffness.check_positive_definite(K_p, rotation.K_o, coupling)
    return coupling
